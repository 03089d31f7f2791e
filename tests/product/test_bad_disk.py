"""A cache that is read-only, full or damaged, and pointers that are garbage."""

import json
import shutil
import subprocess

import pytest
from disks import mounted
from tiny_study import half_written

SIMULATE = (
    *("simulate", "--no-figures", "--executor", "serial"),
    *("--set", "simulate.repetitions=2", "--set", "simulate.episodes=20"),
)


@pytest.fixture(scope="module")
def simulated(hrcneuro, tmp_path_factory):
    """A working folder with one entry; copy it before spoiling it."""
    folder = tmp_path_factory.mktemp("simulated") / "work"
    assert hrcneuro(*SIMULATE, "--workdir", folder).code == 0
    return folder


@pytest.fixture
def work(simulated, tmp_path):
    return shutil.copytree(simulated, tmp_path / "work")


def entry(work):
    (folder,) = (p.parent for p in work.glob("cache/simulate/group/*/record.json"))
    return folder


def only_item(done):
    (item,) = done.json["items"]
    return item


def test_a_read_only_disk(hrcneuro, tmp_path, simulated):
    with mounted(tmp_path / "disk", "size=64m") as disk:
        shutil.copytree(simulated, disk / "work")
        subprocess.run(["mount", "-o", "remount,ro", str(disk)], check=True)
        hit = hrcneuro(*SIMULATE, "--workdir", disk / "work", "--json")
        assert (hit.code, only_item(hit)["state"]) == (0, "hit"), hit.err
        assert hrcneuro("status", "--workdir", disk / "work").code == 0
        assert hrcneuro("cache", "verify", "--workdir", disk / "work").code == 0
        for workdir in (disk / "work", disk / "new"):
            done = hrcneuro(*SIMULATE, "--set", "simulate.seed=5", "--workdir", workdir, "--json")
            assert done.code == 2, done.err
            assert "cannot be written" in only_item(done)["error"]["problem"]
            assert "HRCNEURO_CACHE" in only_item(done)["error"]["cure"]


@pytest.mark.parametrize("place", ["a file/work", "/proc/nowhere"])
def test_a_place_that_cannot_be_written(hrcneuro, tmp_path, place):
    (tmp_path / "a file").write_text("")
    done = hrcneuro(*SIMULATE, "--workdir", tmp_path / place, "--json")
    assert done.code == 2, done.err
    assert "cannot be written" in only_item(done)["error"]["problem"]


@pytest.mark.parametrize("size", ["16k", "48k", "80k"])
def test_a_full_disk(hrcneuro, tmp_path, simulated, size):
    whole = sum(p.stat().st_size for p in entry(simulated).iterdir())
    assert whole > 90_000, "sizes of this test must be below that of the entry"
    with mounted(tmp_path / "disk", f"size={size}") as disk:
        done = hrcneuro(*SIMULATE, "--workdir", disk, "--json")
        assert done.code == 1, done.err
        assert "is full" in only_item(done)["error"]["problem"]
        assert "--workdir" in only_item(done)["error"]["cure"]
        assert "Traceback" not in done.err
        assert half_written(disk) == []
        assert list(disk.glob("cache/simulate/group/*")) == []


def test_a_disk_that_is_full_of_numbers_leaves_them_whole(hrcneuro, tmp_path):
    drawn = [word for word in SIMULATE if word != "--no-figures"]
    with mounted(tmp_path / "disk", "size=240k") as disk:
        done = hrcneuro(*drawn, "--workdir", disk, "--json")
        assert done.code == 1, done.err
        numbers, pictures = done.json["items"]
        assert (numbers["state"], pictures["state"]) == ("ran", "failed")
        assert "is full" in pictures["error"]["problem"]
        assert half_written(disk) == []
        assert hrcneuro("cache", "verify", "--workdir", disk).code == 0


def shorten(path):
    path.write_bytes(path.read_bytes()[:-1])


def flip(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


DAMAGE = {
    "record is no JSON": (lambda e: (e / "record.json").write_text("{"), "record.json"),
    "record is a list": (lambda e: (e / "record.json").write_text("[1]"), "record.json"),
    "record has another byte": (lambda e: flip(e / "record.json"), "record.json"),
    "record of another version": (
        lambda e: (e / "record.json").write_text((e / "record.json").read_text().replace("{", '{"format": 9,', 1)),
        "record.json",
    ),
    "record is gone": (lambda e: (e / "record.json").unlink(), "record.json"),
    "artifact is short": (lambda e: shorten(e / "curves.parquet"), "curves.parquet"),
    "artifact is gone": (lambda e: (e / "curves.parquet").unlink(), "curves.parquet is missing"),
    "entry is a file": (lambda e: (shutil.rmtree(e), e.write_text("")), "record.json"),
}


@pytest.mark.parametrize("name", DAMAGE)
def test_a_damaged_entry_is_no_hit_and_its_damage_is_named(hrcneuro, work, name):
    damage, word = DAMAGE[name]
    damage(entry(work))
    item = only_item(hrcneuro(*SIMULATE, "--workdir", work, "--json", "--dry-run"))
    assert item["state"] == "would-run"
    assert item["why"][0].startswith("corrupt: ")
    assert word in item["why"][0]


@pytest.mark.parametrize("name", ["record has another byte", "artifact is short", "entry is a file"])
def test_a_damaged_entry_is_quarantined_and_rebuilt_as_it_was(hrcneuro, work, name):
    before = {p.name: p.read_bytes() for p in entry(work).iterdir() if p.name != "record.json"}
    DAMAGE[name][0](entry(work))
    done = hrcneuro(*SIMULATE, "--workdir", work, "--json")
    assert done.code == 0, done.err
    assert only_item(done)["state"] == "ran"
    assert {p.name: p.read_bytes() for p in entry(work).iterdir() if p.name != "record.json"} == before
    assert len(list(work.glob("cache/.quarantine/*"))) == 1


def test_a_changed_byte_is_found_by_verify(hrcneuro, work):
    flip(entry(work) / "curves.parquet")
    assert only_item(hrcneuro(*SIMULATE, "--workdir", work, "--json"))["state"] == "hit"
    item = only_item(hrcneuro(*SIMULATE, "--workdir", work, "--json", "--verify"))
    assert (item["state"], item["why"]) == ("ran", ["corrupt: the content of curves.parquet has changed"])
    flip(entry(work) / "curves.parquet")
    done = hrcneuro("cache", "verify", "--workdir", work, "--json")
    assert done.code == 3
    assert list(done.json["bad"].values()) == ["the content of curves.parquet has changed"]
    assert hrcneuro("cache", "verify", "--workdir", work).code == 0


@pytest.mark.parametrize("text", ["{", '{"key": "../..", "parts": {"code": 1}}'])
def test_a_garbage_pointer_is_as_good_as_none_but_gc_drops_nothing(hrcneuro, work, text):
    pointer = work / "results" / "group" / "simulate.json"
    sound = pointer.read_text()
    pointer.write_text(text)
    assert hrcneuro("path", "simulate", "group", "--workdir", work).code == 3
    done = hrcneuro("cache", "gc", "--workdir", work)
    assert done.code == 3
    assert f"{pointer}, which says what this study uses, cannot be understood" in done.err
    assert entry(work).is_dir()
    assert hrcneuro("status", "--workdir", work, "--set", "simulate.seed=5").code == 0
    assert only_item(hrcneuro(*SIMULATE, "--workdir", work, "--json"))["state"] == "hit"
    assert pointer.read_text() == sound
    assert hrcneuro("cache", "gc", "--workdir", work).code == 0


def test_status_and_dry_run_write_nothing_and_take_no_lock(hrcneuro, work):
    def contents():
        return {p: p.stat().st_mtime_ns for p in sorted(work.rglob("*"))}

    shutil.rmtree(work / "cache" / ".locks")
    before = contents()
    for words in (
        ["status"],
        ["status", "--json"],
        ["run", "--dry-run"],
        ["cache", "ls"],
        ["cache", "gc", "--dry-run"],
    ):
        assert hrcneuro(*words, "--workdir", work, "--set", "acquire.seed=1").code == 0
    assert contents() == before


def test_force_replaces_a_sound_entry_without_quarantine(hrcneuro, work):
    item = only_item(hrcneuro(*SIMULATE, "--workdir", work, "--json", "--force"))
    assert (item["state"], item["why"]) == ("ran", ["forced"])
    assert not (work / "cache" / ".quarantine").exists()


def test_gc_drops_what_no_result_points_at(hrcneuro, work):
    kept = entry(work).name
    (work / "cache" / "erp" / "s01" / "0123456789abcdef").mkdir(parents=True)
    assert hrcneuro("cache", "gc", "--workdir", work, "--json").json["dropped"] == ["erp/s01/0123456789abcdef"]
    assert [e["key"] for e in hrcneuro("cache", "ls", "--workdir", work, "--json").json["entries"]] == [kept]


def test_a_report_that_cannot_be_written_fails_in_one_document(hrcneuro, tiny):
    (tiny / "pipeline.toml").write_text('config = "tiny.toml"\nstages = ["simulate"]\n')
    (tiny / "study" / "results" / "report.html").mkdir(parents=True)
    done = hrcneuro("run", tiny / "pipeline.toml", "--workdir", tiny / "study", "--json", "--no-figures")
    assert done.code != 0
    assert only_item(done)["state"] == "ran"
    assert done.json["ok"] is False
    assert done.json["error"]["cure"]
    assert json.loads(done.out)


@pytest.mark.parametrize("place", ["cache", "."])
def test_a_link_that_leads_back_to_itself_is_named(hrcneuro, tmp_path, place):
    work = tmp_path / "work"
    loop = work if place == "." else work / place
    loop.parent.mkdir(exist_ok=True)
    loop.symlink_to(loop.name)
    done = hrcneuro(*SIMULATE, "--workdir", work)
    assert done.code == 2
    assert f"{loop} is a link that leads back to itself" in done.err
    assert hrcneuro("status", "--workdir", work, "--config", "smoke").code in (0, 2)
