"""What makes a result stale, and what does not: on a copy of the package whose source is edited."""

import functools
import os
from pathlib import Path

import pytest
from started import libraries
from tiny_study import ROOT, Copy, artifacts

from hrcneuro import drawings, stages
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
    before = {p: (p.read_bytes(), p.stat().st_mtime_ns) for p in copy.package.rglob("*.py")}
    yield copy
    for path, (content, time_ns) in before.items():
        if path.read_bytes() != content:
            path.write_bytes(content)
            # By the time, to a second, and the size Python tells whether what it has compiled is of this source.
            os.utime(path, ns=(time_ns, time_ns))


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
    assert {name: state for name, state in states(again).items() if ".figures" not in name} == {
        "acquire s01": "hit",
        "preprocess s01": "ran",
        "epoch s01": "hit",
        "simulate group": "hit",
    }
    assert again["preprocess s01"]["why"] == ["code: hrcneuro.eeg.filters"]


def ran(items):
    """Return the kinds of what did not come from the cache."""
    return {item["kind"] for item in items.values() if item["state"] != "hit"}


def test_an_edited_colour_draws_and_computes_nothing(pristine):
    pristine.items(*RUN)
    pristine.edit("figures/style.py", '"#0072B2"', '"#0072B3"')
    again = pristine.items(*RUN)
    assert ran(again) == {"pictures"}
    assert again["preprocess.figures s01"]["why"] == ["code: hrcneuro.figures.style"]


def test_another_minor_version_of_matplotlib_draws_and_computes_nothing(copy):
    copy.items(*RUN)
    told = copy.package.parent / "matplotlib-9.9.0.dist-info"
    told.mkdir()
    (told / "METADATA").write_text("Metadata-Version: 2.1\nName: matplotlib\nVersion: 9.9.0\n")
    try:
        assert ran(copy.items(*RUN)) == {"pictures"}
    finally:
        (told / "METADATA").unlink()
        told.rmdir()


def test_a_deleted_picture_is_drawn_again_and_nothing_computed(copy):
    picture = Path(copy.items(*RUN)["preprocess.figures s01"]["artifacts"]["quality.png"])
    picture.unlink()
    again = copy.items(*RUN)
    assert ran(again) == {"pictures"}
    assert picture.is_file()


def test_a_picture_follows_the_artifact_that_it_shows(copy):
    copy.items(*RUN)
    again = copy.items(*RUN, "--set", "preprocess.l_freq=0.6")
    # The pass band is drawn, too.
    assert again["preprocess.figures s01"]["why"] == [
        "params: preprocess.l_freq 1.0 -> 0.6",
        "inputs: preprocess/s01/quality.parquet",
        "inputs: preprocess/s01/spectrum.parquet",
    ]


def test_pictures_can_be_left_out(copy):
    items = copy.items(*RUN, "--no-figures")
    assert {item["kind"] for item in items.values()} == {"numbers"}


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
from hrcneuro.config import settings
from hrcneuro.contract import Inputs
from hrcneuro.pipeline import graph, job, keys
from hrcneuro.pipeline.workdir import Workdir
room, name, unit, smoke, out = sys.argv[1:]
study = settings.load(Path("configs/smoke.toml"))
where = Workdir(Path(smoke))
everything = graph.closure(study, graph.targets(study, study.sections, ()))
task = (graph.Task.drawing if room == "drawings" else graph.Task.of)(name, unit)
needs = (everything | graph.pictures(study, everything, joint=True))[task]
files = {}
for source in needs:
    folder = where.artifact(source.name, source.unit)
    files.setdefault(source.name, {})[source.unit] = {p.name: p for p in folder.iterdir()}
options = keys.Keys(study, where).config(task)
call, _ = job.work_of(task, options)
if room == "drawings":
    # Writing the finished picture loads nothing of ours, and takes longer than all else.
    from matplotlib.figure import Figure
    Figure.savefig = lambda *_, **__: None
call(options, Inputs(unit, files), Path(out))
print(*sorted(m for m in sys.modules if m.startswith("hrcneuro.")))
"""
# What the harness around a stage loads by itself, whichever the stage.
HARNESS = """
import sys
from hrcneuro.config import settings
from hrcneuro.pipeline import graph, job, keys
study = settings.load()
graph.pictures(study, graph.closure(study, graph.targets(study, study.sections, ())), joint=True)
print(*(m for m in sys.modules if m.startswith("hrcneuro.")))
"""
WORK = [("stages", n, "s01" if stages.load(n).subject else "group") for n in stages.NAMES]
WORK += [
    ("drawings", name, unit)
    for name in drawings.NAMES
    for unit, drawing in (("s01", drawings.load(name).subject), ("group", drawings.load(name).group))
    if drawing
]


@functools.cache
def harness():
    """Return the modules that every task finds loaded."""
    return frozenset(python(HARNESS))


@pytest.mark.parametrize(("room", "name", "unit"), WORK)
def test_every_module_that_a_task_loads_is_part_of_its_key(hrcneuro, smoke, tmp_path, room, name, unit):
    """The modules of a key are read from the source; what Python really loads is the judge."""
    if room == "drawings" and name in stages.NAMES and stages.load(name).on_demand:
        # The study has not made what is to be drawn.
        done = hrcneuro(name, unit, "--config", "configs/smoke.toml", "--workdir", smoke, "--no-figures")
        assert done.code == 0, done.err
    hashed = fingerprint.code(f"hrcneuro.{room}.{name}", ROOT / "hrcneuro", fingerprint.Memo(tmp_path / "memo"))
    loaded = python(LOADED, room, name, unit, smoke, tmp_path)
    assert f"hrcneuro.{room}.{name}" in loaded
    assert loaded - harness() - set(hashed) == set()


@pytest.mark.parametrize("name", stages.NAMES)
def test_no_picture_is_part_of_the_key_of_numbers(tmp_path, name):
    hashed = fingerprint.code(f"hrcneuro.stages.{name}", ROOT / "hrcneuro", fingerprint.Memo(tmp_path / "memo"))
    assert not [m for m in hashed if m.startswith(("hrcneuro.figures", "hrcneuro.drawings", "hrcneuro.report"))]
    assert "matplotlib" not in stages.load(name).libraries


def python(code, *arguments):
    ended, out, err = libraries().run(arguments, code=code, cwd=ROOT, timeout=300)
    assert ended == 0, err
    return set(out.split())


def test_workers_and_the_order_of_subjects_change_no_byte_and_no_key(hrcneuro, tiny, finished):
    """The smoke study shows the same for every stage and picture where time permits: see tests/chaos."""
    (tiny / "pictures.toml").write_text('config = "tiny.toml"\nstages = ["preprocess"]\nreport = false\n')
    for given in (["pipeline.toml", "--no-figures", "-j", 2], ["pictures.toml", "-j", 1]):
        done = hrcneuro("run", *given, "--set", 'study.subjects=["s02", "s01"]', "--workdir", "two", cwd=tiny)
        assert done.code == 0, done.err
    two = artifacts(tiny / "two")
    assert len(two) > 10
    assert any(name.startswith("quality.figures/group/") for name in two)
    # One worker, in the usual order, which has drawn more.
    rooms = {name.partition("/")[0] for name in two}
    one = {name: digest for name, digest in artifacts(finished / "one").items() if name.partition("/")[0] in rooms}
    assert one == two
