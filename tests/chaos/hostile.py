"""Records and files that somebody has put there to do harm: ``python tests/chaos/hostile.py [TRIALS] [SEED]``.

In a bucket that a run reads through, in the cache itself, and in what the cache notes for itself. Nothing outside the
cache may be read into it, written or run; what is refused is computed here, and the run ends complete.
"""

import hashlib
import json
import os
import pickle
import random
import shutil
import sys

from study import RUN, call, complete, fresh, reference  # first: it makes the helpers importable

from quick import Quick  # isort: skip
from table import Fault, Lost, tell

from hrcneuro.cache import sealed


class _Payload:
    """Makes a file where somebody unpickles it."""

    def __init__(self, place):
        self.place = place

    def __reduce__(self):
        return (open, (str(self.place), "w"))


def _names(bucket, path, content, base, draw):
    name = draw.choice(list(content["outputs"]))
    secret = base / "secret.json"
    about = {"sha256": hashlib.sha256(secret.read_bytes()).hexdigest(), "size": secret.stat().st_size}
    evil = draw.choice(
        [
            *("../../../../secret.json", str(secret), "a/../../../../../secret.json", ".hidden", "a\x00b", ""),
            *("a\ud800.json", "record.json/x.json", "a/record.json", "ä" * 200),
        ]
    )
    content["outputs"][evil] = draw.choice([about, content["outputs"][name]])


def _sizes(bucket, path, content, base, draw):
    name = draw.choice(list(content["outputs"]))
    content["outputs"][name]["size"] = draw.choice([10**15, 10**40, -1, "12", True, None, 1.5])


def _hashes(bucket, path, content, base, draw):
    name = draw.choice(list(content["outputs"]))
    content["outputs"][name]["sha256"] = draw.choice(["../../secret", "0" * 64, "x", None, 7, "A" * 64])


def _shapes(bucket, path, content, base, draw):
    name = draw.choice(["outputs", "parts", "summary", "provenance", "stage", "unit", "key"])
    content[name] = draw.choice([[], None, 7, "..", {"..": "a"}])


def _many(bucket, path, content, base, draw):
    name = draw.choice(list(content["outputs"]))
    content["outputs"] |= {f"{number}.json": content["outputs"][name] for number in range(20_000)}


def _nested(bucket, path, content, base, draw):
    # Not by way of JSON: a writer of it would not go so deep.
    return ("[" * 200_000 + "]" * 200_000).encode()


def _long(bucket, path, content, base, draw):
    return b'{"a": "' + b"x" * (17 * 2**20) + b'"}'


def _wide_number(bucket, path, content, base, draw):
    return b'{"stage": ' + b"9" * 10_000 + b"}"


def _endless(bucket, path, content, base, draw):
    path.unlink()
    path.symlink_to("/dev/zero")


def _pipe(bucket, path, content, base, draw):
    path.unlink()
    os.mkfifo(path)


def _link(bucket, path, content, base, draw):
    """Let a file be a link to one outside."""
    place = draw.choice(_files(bucket, path, content))
    copy = base / f"outside-{place.name}"
    shutil.copy(place, copy)
    place.unlink()
    place.symlink_to(copy)


def _pickled(bucket, path, content, base, draw):
    """Let a file be one that does something where it is unpickled, under its own right hash."""
    data = pickle.dumps(_Payload(base / "harm"))
    name = draw.choice(list(content["outputs"]))
    about = {"sha256": hashlib.sha256(data).hexdigest(), "size": len(data)}
    place = bucket / "files" / about["sha256"][:2] / about["sha256"]
    place.parent.mkdir(exist_ok=True)
    place.write_bytes(data)
    new = draw.choice([name, "model.pkl", "data.npy"])
    content["outputs"] = {**{n: a for n, a in content["outputs"].items() if n != name}, new: about}


IN_BUCKET = (_names, _sizes, _hashes, _shapes, _many, _nested, _long, _wide_number, _endless, _pipe, _link, _pickled)
IN_CACHE = (_names, _sizes, _hashes, _shapes, _many, _nested, _long, _wide_number, _endless, _pipe, _link)


def _bomb(path, draw):
    path.write_text(draw.choice(["[", '{"a":']) * 200_000 + "\n")


def _huge(path, draw):
    with path.open("wb") as file:
        file.truncate(2**40)  # of holes


def _digits(path, draw):
    path.write_text("9" * 10_000 + "\n")


def _shape(path, draw):
    words = ["{}", "null", '[{"a": 1}]', '{"0": [[1, 2, 3], 7]}', '["erp", 7]', "4711\nevil\n\nsings"]
    path.write_text(draw.choice(words) + "\n")


def _values(path, draw):
    """Keep the form, and put other values into it."""
    text = path.read_text() if path.is_file() else ""
    try:
        known = json.loads(text)
        value = draw.choice([None, 7, ["a"], {"a": []}])
        path.write_text(json.dumps({name: [one[0], value] for name, one in known.items()}))
    except (ValueError, AttributeError, TypeError, KeyError, IndexError):
        path.write_text(text.replace('"', draw.choice(["", "[", "\\ud800"])) + "\n")


def _bytes(path, draw):
    path.write_bytes(draw.randbytes(500))


def _a_pipe(path, draw):
    os.mkfifo(path)


def _a_folder(path, draw):
    path.mkdir()


def _endless_link(path, draw):
    path.symlink_to("/dev/zero")


OF_ITS_OWN = (_bomb, _huge, _digits, _shape, _values, _bytes, _a_pipe, _a_folder, _endless_link)
PLACES = ("memo", "list", "slim", "before", "lock")


def main(trials=36, seed=0):
    """Return 0 where nothing was lost."""
    base, draw = fresh("hostile"), random.Random(seed)
    wanted = reference(base)
    pushed = call(base, "cache", "push", base / "bucket", "--workdir", "calm", "-q")
    faults = [
        Fault("hostile records in a bucket"),
        Fault("hostile records in the cache"),
        Fault("hostile notes of the cache's own"),
    ]
    if pushed.returncode:
        faults[0].skip(pushed.stderr.splitlines()[0])
    for number in range(trials):
        kind = IN_BUCKET[number % len(IN_BUCKET)]
        if not faults[0].note:
            with faults[0].trial(kind.__name__[1:]):
                _bucket(base, wanted, kind, draw)
        kind = IN_CACHE[number % len(IN_CACHE)]
        with faults[1].trial(kind.__name__[1:]):
            _cache(base, wanted, kind, draw)
        kind, place = OF_ITS_OWN[number % len(OF_ITS_OWN)], PLACES[number % len(PLACES)]
        with faults[2].trial(f"{kind.__name__[1:]} as {place}"):
            _notes(base, wanted, place, kind, draw)
    shutil.rmtree(base)
    return tell(faults)


def _bucket(base, wanted, kind, draw):
    bucket, study = base / "evil", base / "study"
    shutil.copytree(base / "bucket", bucket)
    _spoil(kind, bucket, draw.choice(sorted(bucket.glob("records/*/*/*.json"))), base, draw)
    try:
        (study / "results").mkdir(parents=True)
        pulled = call(base, "cache", "pull", bucket, "--workdir", study, "-q", timeout=120)
        if pulled.returncode not in (0, 3) or "Traceback" in pulled.stderr:
            raise Lost(f"pull ends with {pulled.returncode}: {pulled.stderr[-500:]}")
        _ends_complete(base, study, wanted, "--from", bucket)
    finally:
        shutil.rmtree(bucket)
        shutil.rmtree(study)


def _cache(base, wanted, kind, draw):
    study = base / "study"
    shutil.copytree(base / "calm", study)
    _spoil(kind, study / "cache", draw.choice(sorted(study.glob("cache/*/*/*/record.json"))), base, draw)
    try:
        plain = call(base, *RUN, "--workdir", study, "--executor", "serial", timeout=120)
        if plain.returncode not in (0, 3) or "Traceback" in plain.stderr:
            raise Lost(f"exit code {plain.returncode}: {plain.stderr[-500:]}")
        # Whether a file that nobody reads just now is what its record says, only who asks for it is told.
        _ends_complete(base, study, wanted, "--verify")
    finally:
        shutil.rmtree(study)


def _notes(base, wanted, place, kind, draw):
    """Spoil what the cache notes for itself; the run ends complete, and gc drops nothing that is pointed at."""
    study = base / "study"
    shutil.copytree(base / "calm", study)
    cache = study / "cache"
    lock = draw.choice(sorted(cache.glob(".locks/*.lock")))
    entry = draw.choice(sorted(cache.glob("[!.]*/*/*/record.json"))).parent
    path = {
        "memo": cache / ".memo.json",
        "list": draw.choice(sorted(cache.glob(".studies/*.jsonl"))),
        "slim": entry / ".slim",
        "before": cache / ".before-the-list",
        "lock": lock,
    }[place]
    if place == "lock":
        # So that somebody wants it.
        shutil.rmtree(cache.joinpath(*lock.stem.split("-", 2)))
    if kind in (_a_pipe, _a_folder, _endless_link):
        path.unlink(missing_ok=True)
    kind(path, draw)
    try:
        _ends_complete(base, study, wanted, environment={"HRCNEURO_LOCK_WAIT": "1"})
        cleaned = call(base, "cache", "gc", "--now", "--workdir", study, "-q", timeout=120)
        if cleaned.returncode not in (0, 2, 3) or "Traceback" in cleaned.stderr:
            raise Lost(f"gc ends with {cleaned.returncode}: {cleaned.stderr[-500:]}")
        complete(study, wanted)
    finally:
        shutil.rmtree(study)


def _spoil(kind, bucket, path, base, draw):
    """Write a record that is hostile, under a right seal where it has one."""
    for stale in base.glob("outside-*"):
        stale.unlink()
    (base / "secret.json").write_text('{"secret": 1}')
    content = json.loads(path.read_text())
    content.pop("seal")
    data = kind(bucket, path, content, base, draw)
    if path.is_symlink() or not path.is_file():
        return
    path.write_bytes(data if data is not None else sealed.write(content).encode())


def _files(bucket, path, content):
    """Return where the files of a record lie, in a bucket or in an entry."""
    if path.name == "record.json":
        return [path.parent / name for name in content["outputs"]]
    return [bucket / "files" / a["sha256"][:2] / a["sha256"] for a in content["outputs"].values()]


def _ends_complete(base, study, wanted, *words, environment=None):
    run = Quick(base, *RUN, "--workdir", study, "--executor", "serial", *words, environment=environment)
    code = run.wait(120)
    said = run.said()
    if code == 3 and "does not tell what it should" in said:
        # Numbers of a summary that nobody else can know: named, with what makes them anew.
        run = Quick(base, *RUN, "--workdir", study, "--executor", "serial", "--force")
        code, said = run.wait(120), run.said()
    if code != 0:
        run.kill(group=True)
        raise Lost(f"exit code {code}: {said[-700:]}")
    complete(study, wanted)
    if (base / "harm").exists():
        raise Lost("what was pickled was run")
    if (base / "secret.json").read_text() != '{"secret": 1}':
        raise Lost("a file outside was written")
    if [p for p in study.glob("cache/[!.]*/*/*/[!.]*") if p.is_symlink()]:
        raise Lost("a link is in the cache")


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
