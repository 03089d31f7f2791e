import json
import os

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hrcneuro.cache import fingerprint
from hrcneuro.cache.why import causes

JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=8,
)


@given(st.dictionaries(st.text(), JSON, max_size=5))
def test_a_digest_does_not_depend_on_the_order_of_keys(table):
    assert fingerprint.digest(table) == fingerprint.digest(dict(reversed(table.items())))


@given(JSON, JSON)
def test_different_values_have_different_digests(a, b):
    same = json.dumps(a, sort_keys=True) == json.dumps(b, sort_keys=True)
    assert (fingerprint.digest(a) == fingerprint.digest(b)) == same


@given(st.dictionaries(st.text(), JSON, max_size=5))
def test_a_key_is_the_digest_of_its_parts_whoever_has_written_some_of_them_before(parts):
    texts = {name: fingerprint.canonical(part) for name, part in list(parts.items())[::2]}
    assert fingerprint.key(parts) == fingerprint.key(parts, texts) == fingerprint.digest(parts)[:16]


@pytest.fixture
def package(tmp_path):
    root = tmp_path / "house"
    (root / "rooms").mkdir(parents=True)
    (root / "__init__.py").write_text("")
    (root / "rooms" / "__init__.py").write_text("")
    (root / "stage.py").write_text(
        "from typing import TYPE_CHECKING\n"
        "if TYPE_CHECKING:\n    from house.rooms import unused\n"
        "def run():\n    'A docstring.'\n    from house.rooms import kitchen\n    return kitchen.cook()\n"
    )
    (root / "rooms" / "kitchen.py").write_text("from . import water\ndef cook():\n    return 1  # why\n")
    (root / "rooms" / "water.py").write_text("WET = True\n")
    (root / "rooms" / "unused.py").write_text("X = 1\n")
    return root


def read(package):
    return fingerprint.code("house.stage", package, fingerprint.Memo(package / "memo.json"))


def test_code_follows_imports_also_those_inside_functions_but_not_those_for_types(package):
    assert set(read(package)) == {"house.stage", "house.rooms", "house.rooms.kitchen", "house.rooms.water"}


@pytest.mark.parametrize(
    ("old", "new", "changes"),
    [
        ("# why", "# because", False),
        ("def cook", "\n\ndef cook", False),
        ("return 1", "return 2", True),
        ("def cook():\n", "def cook():\n    'What it does.'\n", False),
    ],
)
def test_only_code_changes_a_hash(package, old, new, changes):
    before = read(package)
    path = package / "rooms" / "kitchen.py"
    path.write_text(path.read_text().replace(old, new))
    after = read(package)
    assert (before != after) == changes
    assert [k for k in before if before[k] != after[k]] == (["house.rooms.kitchen"] if changes else [])


def test_the_memo_notices_a_file_of_the_same_size_and_another_content(tmp_path):
    path = tmp_path / "x"
    memo = fingerprint.Memo(tmp_path / "memo.json")
    path.write_text("aaaa")
    os.utime(path, ns=(5, 5))
    first = memo.get("bytes", path, fingerprint.file_digest)
    memo.save()
    remembered = fingerprint.Memo(tmp_path / "memo.json")
    assert remembered.get("bytes", path, lambda p: pytest.fail("it is remembered")) == first
    path.write_text("bbbb")
    os.utime(path, ns=(1, 1))
    assert fingerprint.Memo(tmp_path / "memo.json").get("bytes", path, fingerprint.file_digest) != first


def test_the_memo_does_not_trust_a_file_that_was_written_a_moment_ago(tmp_path):
    path = tmp_path / "x"
    memo = fingerprint.Memo(tmp_path / "memo.json")
    path.write_text("aaaa")
    first = memo.get("bytes", path, fingerprint.file_digest)
    stamp = path.stat()
    path.write_text("bbbb")
    os.utime(path, ns=(stamp.st_atime_ns, stamp.st_mtime_ns))
    assert memo.get("bytes", path, fingerprint.file_digest) != first


@pytest.mark.parametrize("text", ["{", "[]", "7", '"x"', "{} {}", "[" * 200_000, '{"a":' * 200_000, "9" * 10_000])
def test_a_broken_memo_is_ignored(tmp_path, text):
    (tmp_path / "memo.json").write_text(text)
    assert fingerprint.Memo(tmp_path / "memo.json").known == {}


def test_a_memo_as_large_as_a_disk_is_not_read(tmp_path):
    with (tmp_path / "memo.json").open("wb") as file:
        file.truncate(2**40)  # of holes
    assert fingerprint.Memo(tmp_path / "memo.json").known == {}


@pytest.mark.parametrize("value", [None, 7, "x", [], ["a" * 64], ["a" * 64, "house"], ["a" * 64, [7]], {"a": 1}])
def test_what_a_memo_remembers_in_another_shape_is_computed_anew(package, value):
    sound = read(package)
    memo = fingerprint.Memo(package / "memo.json")
    for path in package.rglob("*.py"):
        os.utime(path, ns=(5, 5))
    fingerprint.code("house.stage", package, memo)
    memo.get("bytes", package / "stage.py", fingerprint.file_digest)
    memo.save()
    known = json.loads((package / "memo.json").read_text())
    assert known
    (package / "memo.json").write_text(json.dumps({name: [stamp, value] for name, (stamp, _) in known.items()}))
    assert read(package) == sound
    spoiled = fingerprint.Memo(package / "memo.json")
    assert fingerprint.is_sha256(spoiled.get("bytes", package / "stage.py", fingerprint.file_digest))


def test_a_module_that_loads_lazily_answers_for_what_it_names_for_type_checkers(package):
    (package / "rooms" / "attic.py").write_text("x = 1\n")
    path = package / "rooms" / "__init__.py"
    lazy = "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from house.rooms import attic\n"
    path.write_text(lazy)
    assert "house.rooms.attic" not in read(package)
    path.write_text(lazy + "def __getattr__(name): ...\n")
    assert "house.rooms.attic" in read(package)


def test_libraries_name_python_and_say_absent():
    found = fingerprint.libraries(["numpy", "no-such-library"])
    assert found["no-such-library"] == "absent"
    assert found["numpy"].count(".") == 1
    assert "python" in found


def test_every_cause_of_staleness_is_named():
    old = {
        "params": {"l_freq": 1.0, "inner": {"x": 1}},
        "inputs": {"acquire/s01/raw.fif": "a"},
        "sources": {"s01.set": "a"},
        "code": {"eeg.filters": "a", "eeg.old": "a"},
        "libs": {"mne": "1.12"},
    }
    new = {
        "params": {"l_freq": 0.5, "inner": {"x": 2}},
        "inputs": {"acquire/s01/raw.fif": "b"},
        "sources": {"s01.set": "b"},
        "code": {"eeg.filters": "b", "eeg.new": "a"},
        "libs": {"mne": "1.13"},
    }
    assert causes(old, new, prefix="preprocess.") == [
        "params: preprocess.inner.x 1 -> 2",
        "params: preprocess.l_freq 1.0 -> 0.5",
        "inputs: acquire/s01/raw.fif",
        "sources: s01.set",
        "code: eeg.filters",
        "code: eeg.new (new)",
        "code: eeg.old (gone)",
        "libs: mne 1.12 -> 1.13",
    ]
    assert causes(None, new) == ["never run"]
    assert causes(old, old) == []
