"""What makes a result stale, and what does not: on a copy of the package whose source is edited."""

import subprocess
import sys
from pathlib import Path

import pytest
from tiny_study import ROOT, Copy, artifacts

from hrcneuro import stages
from hrcneuro.cache import fingerprint

RUN = ("run", "pipeline.toml", "--executor", "serial", "--set", 'study.subjects=["s01"]')
STATUS = ("--config", "tiny.toml", "--set", 'study.subjects=["s01"]')


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    copy = Copy(tmp_path_factory.mktemp("staleness"))
    assert {item["state"] for item in copy.items(*RUN).values()} == {"ran"}
    return copy


@pytest.fixture
def pristine(copy):
    """The copy, whose source is afterwards as it was before."""
    before = {p: p.read_bytes() for p in copy.package.rglob("*.py")}
    yield copy
    for path, content in before.items():
        if path.read_bytes() != content:
            path.write_bytes(content)


def states(items):
    return {name: item["state"] for name, item in items.items()}


def all_hits(items):
    return set(states(items).values()) == {"hit"}


def test_the_copy_is_what_runs(copy):
    assert Path(copy.python("-c", "import hrcneuro; print(hrcneuro.__file__)").strip()).parent == copy.package


def test_a_second_run_takes_everything_from_the_cache(copy):
    assert all_hits(copy.items(*RUN))


@pytest.mark.parametrize(
    ("module", "old", "new"),
    [
        ("eeg/filters.py", "\nimport numpy", "\n# A remark.\nimport numpy"),
        ("eeg/filters.py", '"""', '"""Said otherwise. '),
        ("learning/learner.py", "\ndef ", "\n\n\n\ndef "),
        ("stages/preprocess.py", '"""', '"""Said otherwise: '),
    ],
)
def test_an_edited_comment_docstring_or_blank_line_is_a_hit(pristine, module, old, new):
    pristine.edit(module, old, new)
    assert all_hits(pristine.items("run", "pipeline.toml", "--dry-run", *RUN[4:]))


@pytest.mark.parametrize(
    ("module", "name", "stale"),
    [
        ("eeg/filters.py", "hrcneuro.eeg.filters", {"preprocess"}),
        ("learning/learner.py", "hrcneuro.learning.learner", {"simulate"}),
        ("stages/epoch.py", "hrcneuro.stages.epoch", {"epoch"}),
        # Loaded on first use only, behind the package's __getattr__.
        ("eeg/synthetic/generator.py", "hrcneuro.eeg.synthetic.generator", {"acquire"}),
    ],
)
def test_an_edited_helper_makes_the_stages_that_use_it_stale_and_status_names_it(pristine, module, name, stale):
    (pristine.package / module).write_text((pristine.package / module).read_text() + "\n_EDITED = True\n")
    items = pristine.items("status", *STATUS)
    named = {item["stage"] for item in items.values() if item["why"] == [f"code: {name}"]}
    assert {stage for stage in named if stage in ("acquire", "preprocess", "epoch", "simulate")} == stale
    assert f"code: {name}" in pristine.python("-m", "hrcneuro", "status", *STATUS, "--workdir", "study")


def test_an_edited_helper_reruns_its_stage_and_an_unchanged_output_stops_there(pristine):
    path = pristine.package / "eeg" / "filters.py"
    path.write_text(path.read_text() + "\n_EDITED = True\n")
    again = pristine.items(*RUN)
    assert states(again) == {
        "acquire s01": "hit",
        "preprocess s01": "ran",
        "epoch s01": "hit",
        "simulate group": "hit",
    }
    assert again["preprocess s01"]["why"] == ["code: hrcneuro.eeg.filters"]


def test_a_parameter_changed_and_changed_back_is_a_hit(copy):
    copy.items(*RUN)
    changed = copy.items(*RUN, "--set", "preprocess.l_freq=0.5")
    assert states(changed)["acquire s01"] == "hit"
    assert changed["preprocess s01"]["why"] == ["params: preprocess.l_freq 1.0 -> 0.5"]
    assert states(changed)["epoch s01"] == "ran"
    assert all_hits(copy.items(*RUN))


def test_moving_the_cache_or_the_working_folder_keeps_every_hit(copy):
    study = copy.work / "study"
    elsewhere = copy.work / "elsewhere"
    (study / "cache").rename(elsewhere)
    assert all_hits(copy.items(*RUN, HRCNEURO_CACHE=str(elsewhere)))
    elsewhere.rename(study / "cache")
    study.rename(copy.work / "moved")
    assert all_hits(copy.items(*RUN, workdir="moved"))
    (copy.work / "moved").rename(study)


LOADED = """
import sys
from pathlib import Path
from hrcneuro import stages
from hrcneuro.config import settings as config
from hrcneuro.contract import Inputs
from hrcneuro.pipeline.workdir import Workdir
name, unit, smoke, out = sys.argv[1:]
stage = stages.load(name)
found = config.load(Path("configs/smoke.toml"))
where = Workdir(Path(smoke))
units = found.included if unit == "group" else [unit]
patterns = stage.GROUP_INPUTS if unit == "group" else stage.INPUTS
inputs = Inputs.of(unit, **{up: {u: where.artifact(up, u) for u in units} for up in patterns})
(stage.run_group if unit == "group" else stage.run)(found.sections[name], inputs, Path(out))
print(*sorted(m for m in sys.modules if m.startswith("hrcneuro.")))
"""
# What the harness around a stage loads by itself, whichever the stage.
HARNESS = "from hrcneuro import config, stages, workdir, contract; config.load()"


@pytest.mark.parametrize("name", stages.NAMES)
def test_every_module_that_a_stage_loads_is_part_of_its_key(smoke, tmp_path, name):
    """The modules of a key are read from the source; what Python really loads is the judge."""
    unit = "s01" if hasattr(stages.load(name), "run") else "group"
    hashed = fingerprint.code(f"hrcneuro.stages.{name}", ROOT / "hrcneuro", fingerprint.Memo(tmp_path / "memo"))
    loaded = python(LOADED, name, unit, smoke, tmp_path)
    harness = python(f"import sys; {HARNESS}; print(*(m for m in sys.modules if m.startswith('hrcneuro.')))")
    assert f"hrcneuro.stages.{name}" in loaded
    assert loaded - harness - set(hashed) == set()


def python(code, *arguments):
    done = subprocess.run(
        [sys.executable, "-c", code, *map(str, arguments)], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return set(done.stdout.split())


def test_workers_and_the_order_of_subjects_change_no_byte_and_no_key(hrcneuro, tiny):
    """The smoke study shows the same for every stage where time permits: see kill_many.py."""
    found = {}
    for name, subjects, jobs in (("one", '["s01", "s02"]', 1), ("two", '["s02", "s01"]', 2)):
        done = hrcneuro(
            *("run", tiny / "pipeline.toml", "--set", f"study.subjects={subjects}"),
            *("--workdir", tiny / name, "-j", jobs),
        )
        assert done.code == 0, done.err
        found[name] = artifacts(tiny / name)
    assert len(found["one"]) > 10
    assert found["one"] == found["two"]
