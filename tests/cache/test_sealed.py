"""A record read in pieces says what it says read plainly, whatever has happened to its text since it was written."""

import hashlib
import json
import os
import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrcneuro.cache import fingerprint, sealed
from hrcneuro.cache.record import RECORD, Record, parse_record, read_record, write_record
from hrcneuro.cache.store import Store

NAME = ("erp", "s01", "0123456789abcdef")
# Of what a text in JSON is made, and of what could be taken for it.
TEXT = st.text(alphabet='":\\ ,[]{}\n\tä0a', max_size=8)
JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | TEXT,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(TEXT, inner, max_size=3),
    max_leaves=6,
)
# Members of a record's own names in what it holds.
TABLE = st.dictionaries(TEXT | st.sampled_from(["parts", "provenance", "seal", "code", "inputs"]), JSON, max_size=4)
OUTPUTS = {"a.txt": {"sha256": "0" * 64, "size": 3}, "deep/b.fif": {"sha256": "f" * 64, "size": 0}}
PARTS = st.fixed_dictionaries({"stage": TEXT, "params": TABLE, "unit": TEXT, "code": TABLE, "inputs": TABLE})
BYTES = st.sampled_from([b" ", b"\n", b"\n ", b'"', b":", b": ", b",", b",\n ", b"\\", b"{", b"}", b"1", b"\xff", b""])


@st.composite
def texts(draw, changes=0):
    """Return a record's text as it is written, with some changes at a time: bytes that go, and bytes that come."""
    content = {"stage": "erp", "unit": "s01", "key": NAME[2], "parts": draw(PARTS), "outputs": OUTPUTS}
    content |= {"summary": draw(TABLE), "provenance": draw(TABLE)}
    data = sealed.write(json.loads(json.dumps(content))).encode()
    for _ in range(changes):
        at, gone = draw(st.integers(0, len(data))), draw(st.integers(0, 3))
        data = data[:at] + draw(BYTES) + data[at + gone :]
    return data


def parse_plainly(data):
    """Return what a text holds, without the seal."""
    return {name: value for name, value in json.loads(data).items() if name != "seal"}


def plainly(data):
    """Return what a text holds as any reader of JSON finds it, in canonical form; None where its seal is broken."""
    try:
        content = json.loads(data)
        seal = content.pop("seal")
        return fingerprint.canonical(content) if seal == sealed.seal_of(content) else None
    except (ValueError, TypeError, AttributeError, KeyError):
        return None


@given(texts())
def test_a_record_as_it_was_written_is_read_in_pieces(data):
    found = sealed.read(data)
    assert found is not None
    assert fingerprint.canonical(found) == plainly(data) == fingerprint.canonical(parse_plainly(data))


@settings(max_examples=300)
@given(texts(changes=1) | texts(changes=2) | texts(changes=4))
def test_of_a_damaged_record_nothing_else_is_read_in_pieces(data):
    found = sealed.read(data)
    assert found is None or fingerprint.canonical(found) == plainly(data)


def written(folder, **parts):
    folder.mkdir(parents=True, exist_ok=True)
    parts = {"stage": "erp", "unit": "s01", "code": {"m": "x"}, "params": {"a": 1.5}, **parts}
    write_record(folder, Record(*NAME, parts=parts, outputs=OUTPUTS))
    return (folder / RECORD).read_bytes()


def test_no_byte_of_a_record_can_go_or_change_unseen(tmp_path):
    data = written(tmp_path, inputs={"x": "y: , {"})
    assert sealed.read(data) is not None
    for at in range(len(data)):
        for damaged in (data[:at] + data[at + 1 :], data[:at] + b"~" + data[at + 1 :], data[:at]):
            found = sealed.read(damaged)
            assert found is None or damaged == data


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('"size": 3', '"size": 3,\n   "size": 3'),
        ('\n "stage": "erp"', '\n "stage": "erp",\n "stage": "erp"'),
        ('\n  "stage": "erp"', '\n  "stage": "erp",\n  "stage": "erp"'),
        (',\n "stage": "erp"', ',\n "seal": "",\n "stage": "erp"'),
        ('"code": {', '"code": {},\n  "code": {'),
        ('\n "unit": "s01"', '\n "unit": "s01",\n '),
        ('{\n "key"', '{\n ,\n "key"'),
        ('"parts": {\n', '"parts": {\n,\n'),
    ],
)
def test_what_somebody_sealed_who_writes_otherwise_is_read_plainly_or_to_the_same(tmp_path, old, new):
    """Members that stand there twice, or what is no JSON: pieces never say what the whole does not."""
    text = written(tmp_path).decode()
    body = text.rpartition(',\n "seal"')[0]
    assert old in body
    assert sealed.read(text.encode()) is not None
    assert sealed.read(text.replace(old, new).encode()) is None
    changed = body.replace(old, new)
    seal = hashlib.sha256(f"{changed}\n}}".encode()).hexdigest()
    found = sealed.read(f'{changed},\n "seal": "{seal}"\n}}\n'.encode())
    assert found is None or found == json.loads(f"{changed}\n}}")


def test_what_records_share_is_read_once(tmp_path):
    one = parse_record(written(tmp_path / "a", inputs={"x": "1"}))
    two = parse_record(written(tmp_path / "b", inputs={"x": "2"}))
    assert one.parts["params"] is two.parts["params"]
    assert one.parts["inputs"] != two.parts["inputs"]


def test_what_is_long_is_not_kept(tmp_path):
    data = written(tmp_path, params={"text": "x" * 100_000})
    assert parse_record(data).parts["params"] is not parse_record(data).parts["params"]


def test_a_record_in_another_form_of_json_is_the_same_record(tmp_path):
    data = written(tmp_path)
    other = json.dumps(json.loads(data), separators=(",", ":")).encode()
    assert sealed.read(other) is None
    assert parse_record(other) == parse_record(data)


def test_a_record_with_the_seal_that_records_had_before_is_the_same_record(tmp_path):
    data = written(tmp_path)
    content = parse_plainly(data)
    old = json.dumps({**content, "seal": fingerprint.digest(content)}, indent=1, sort_keys=True).encode()
    assert sealed.read(old) is None
    assert parse_record(old) == parse_record(data)
    with pytest.raises(ValueError, match="its seal is broken"):
        parse_record(old.replace(b'"size": 3', b'"size": 4'))


def test_a_look_at_a_damaged_entry_finds_what_a_plain_one_does(tmp_path, monkeypatch):
    """Whatever was done to its record, its files or the list of those that were dropped."""
    draw = random.Random(7)
    store, both, found = Store(tmp_path / "cache"), [], []
    for number in range(60):
        name = ("erp", f"s{number:02}", NAME[2])
        with store.workspace(*name) as work:
            (work / "a.txt").write_text("text")
            (work / "b.fif").write_text("signal")
            parts = {"stage": "erp", "unit": name[1], "code": {"m": "x"}}
            store.publish(Record(*name, parts=parts, outputs={}, summary={"n": number}), work)
        _damage(store.folder(*name), number % 10, draw)
        both += [(name, slim) for slim in (False, True)]
    for plain in (False, True):
        if plain:
            monkeypatch.setattr(sealed, "read", lambda data: None)
        found.append([(store.look(*name, slim=slim), store.diagnose(*name)) for name, slim in both])
    assert found[0] == found[1]
    sound = [record is not None for (record, _), _ in found[0]]
    assert 10 < sum(sound) < len(sound) - 10


def _damage(folder, kind, draw):
    record = folder / RECORD
    data = record.read_bytes()
    at = draw.randrange(len(data))
    if kind == 0:
        record.write_bytes(data[:at])
    elif kind == 1:
        record.write_bytes(data[:at] + bytes([draw.randrange(256)]) + data[at + 1 :])
    elif kind == 2:
        record.write_bytes(data.replace(b"\n ", b"\n  ", at % 5))
    elif kind == 3:
        record.unlink()
        os.mkfifo(record)
    elif kind == 4:
        (folder / "b.fif").unlink()
        (folder / ".slim").write_text('["b.fif"]')
    elif kind == 5:
        (folder / ".slim").write_text('["b.fif", "a.txt"]')
    elif kind == 6:
        (folder / "a.txt").unlink()
        (folder / "a.txt").symlink_to("b.fif")
    elif kind == 7:
        (folder / "a.txt").write_text("longer text")
    elif kind == 8:
        content = json.loads(data)
        content["key"] = "f" * 16
        record.write_text(json.dumps(content, indent=1, sort_keys=True))


def test_a_record_that_grows_while_it_is_read_is_read_to_its_end(tmp_path, monkeypatch):
    data, read = written(tmp_path), os.read
    monkeypatch.setattr(os, "read", lambda handle, size: read(handle, 10))
    assert read_record(tmp_path) == parse_record(data)
