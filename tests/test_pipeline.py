"""The walk over the graph, on three toy stages: what runs, what is spared, what a failure blocks."""

import dataclasses
from concurrent.futures import Future
from types import SimpleNamespace

import pytest

from hrcneuro import stages
from hrcneuro.config.settings import Settings, Shared, Study
from hrcneuro.contract import option
from hrcneuro.errors import ConfigError, DataError
from hrcneuro.pipeline import graph
from hrcneuro.pipeline import walk as pipeline
from hrcneuro.pipeline.executors import Serial
from hrcneuro.pipeline.workdir import Workdir


@dataclasses.dataclass(frozen=True)
class Config:
    gain: int = option(1, "multiplies")
    path: str = option("", "where", path=True, keyed=False)


class House:
    """Three toy stages that note what they compute."""

    def __init__(self):
        self.calls = []
        self.broken = set()

    def load(self, name):
        return getattr(self, name)

    @property
    def source(self):
        def run(config, inputs, out):
            self.calls.append(("source", inputs.unit))
            if inputs.unit in self.broken:
                raise DataError("no recording", cure="record one")
            (out / "x.txt").write_text(inputs.unit)
            (out / "log.txt").write_text(str(config.gain))
            return {"length": len(inputs.unit)}

        return SimpleNamespace(LIBS=(), INPUTS={}, Config=Config, run=run)

    @property
    def scale(self):
        def run(config, inputs, out):
            self.calls.append(("scale", inputs.unit))
            (out / "y.txt").write_text(inputs.path("source", "x.txt").read_text() * config.gain)
            return {}

        return SimpleNamespace(LIBS=(), INPUTS={"source": ("x.txt",)}, Config=Config, run=run)

    @property
    def total(self):
        def run_group(config, inputs, out):
            self.calls.append(("total", inputs.unit))
            text = "".join(inputs.path("scale", "y.txt", unit=u).read_text() for u in inputs.units("scale"))
            (out / "z.txt").write_text(text)
            return {"text": text}

        return SimpleNamespace(LIBS=(), GROUP_INPUTS={"scale": ("*.txt",)}, Config=Config, run_group=run_group)

    @property
    def long(self):
        def run_part(config, inputs, out):
            self.calls.append(("long", inputs.unit))
            (out / "part.txt").write_text(inputs.unit)
            return {}

        def run_group(config, inputs, out):
            units = inputs.units("long")
            (out / "all.txt").write_text("".join(inputs.path("long", "part.txt", unit=u).read_text() for u in units))
            return {"units": list(units)}

        def parts(config):
            return ("part-1", "part-2")

        return SimpleNamespace(
            LIBS=(), GROUP_INPUTS={}, Config=Config, run_group=run_group, run_part=run_part, parts=parts
        )


@pytest.fixture
def house(monkeypatch):
    house = House()
    monkeypatch.setattr(stages, "NAMES", ("source", "scale", "total", "long"))
    monkeypatch.setattr(stages, "load", house.load)
    monkeypatch.setattr(graph, "_BEFORE_EXCLUSION", ("source",))
    return house


@pytest.fixture
def workdir(tmp_path):
    return Workdir(tmp_path)


def settings(subjects=("a", "b"), exclude=(), **gains):
    sections = {name: Config(gain=gains.get(name, 1)) for name in ("source", "scale", "total", "long")}
    return Settings(Study(subjects=subjects, exclude=exclude), Shared(), sections)


def bring(found, workdir, *subjects, names=("total",), **options):
    wanted = graph.targets(found, names, subjects)
    return pipeline.Run(found, workdir, verify=options.pop("verify", False)).run(wanted, Serial(), **options)


def states(items):
    return {f"{i.stage} {i.unit}": i.state for i in items}


def test_everything_runs_once_and_is_then_a_hit_with_the_same_summary(house, workdir):
    first = bring(settings(), workdir)
    again = bring(settings(), workdir)
    assert set(states(first).values()) == {"ran"}
    assert set(states(again).values()) == {"hit"}
    assert len(house.calls) == 5
    assert [i.summary for i in first] == [i.summary for i in again]


def test_what_a_library_prints_does_not_reach_standard_output(house, workdir, capsys, monkeypatch):
    quiet = house.load

    def load(name):
        stage = quiet(name)
        inner = getattr(stage, "run", None) or stage.run_group
        loud = lambda *args: (print("hello from a library"), inner(*args))[1]  # noqa: E731
        return SimpleNamespace(**{**vars(stage), "run" if hasattr(stage, "run") else "run_group": loud})

    monkeypatch.setattr(stages, "load", load)
    assert set(states(bring(settings(), workdir)).values()) == {"ran"}
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("hello from a library") == 5


def test_an_unchanged_output_stops_reruns(house, workdir):
    bring(settings(), workdir)
    items = bring(settings(source=2), workdir)
    assert states(items) == {
        "source a": "ran",
        "source b": "ran",
        "scale a": "hit",
        "scale b": "hit",
        "total group": "hit",
    }


def test_a_changed_parameter_is_named_and_switching_it_back_is_a_hit(house, workdir):
    bring(settings(), workdir)
    changed = {f"{i.stage} {i.unit}": i.why for i in bring(settings(scale=2), workdir)}
    assert changed["scale a"] == ["params: scale.gain 1 -> 2"]
    assert changed["total group"] == ["inputs: scale/a/y.txt", "inputs: scale/b/y.txt"]
    assert set(states(bring(settings(), workdir)).values()) == {"hit"}


def test_a_location_does_not_enter_the_key(house, workdir):
    bring(settings(), workdir)
    found = settings()
    sections = {name: dataclasses.replace(c, path="/elsewhere") for name, c in found.sections.items()}
    assert set(states(bring(dataclasses.replace(found, sections=sections), workdir)).values()) == {"hit"}


def test_a_failure_blocks_only_what_stands_on_it(house, workdir):
    house.broken = {"a"}
    items = bring(settings(), workdir)
    assert states(items) == {
        "source a": "failed",
        "source b": "ran",
        "scale a": "blocked",
        "scale b": "ran",
        "total group": "blocked",
    }
    assert items[0].error.exit_code == 3
    assert workdir.cache.leftovers() == []


def test_a_plan_says_what_would_run_and_touches_nothing(house, workdir):
    wanted = graph.targets(settings(), ["total"], ())
    items = pipeline.Run(settings(), workdir).plan(wanted)
    assert set(states(items).values()) == {"would-run"}
    assert items[0].why == ["never run"]
    assert items[-1].why == ["inputs: scale of a would run", "inputs: scale of b would run"]
    assert house.calls == []
    assert list(workdir.folder.iterdir()) == []


def test_force_reruns_what_is_named_and_not_what_it_stands_on(house, workdir):
    bring(settings(), workdir)
    items = bring(settings(), workdir, "a", names=("scale",), force=True)
    assert states(items) == {"source a": "hit", "scale a": "ran"}
    assert items[1].why == ["forced"]


def test_a_corrupt_entry_is_quarantined_and_rebuilt(house, workdir):
    bring(settings(), workdir)
    workdir.artifact("scale", "a", "y.txt").write_text("longer than before")
    items = {f"{i.stage} {i.unit}": i for i in bring(settings(), workdir)}
    assert items["scale a"].why == ["corrupt: y.txt has 18 bytes instead of 1"]
    assert items["total group"].state == "hit"
    assert len(list(workdir.cache.root.glob(".quarantine/*"))) == 1


def test_a_content_that_changed_is_not_read(house, workdir):
    bring(settings(), workdir)
    before = workdir.artifact("total", "group", "z.txt").read_text()
    workdir.artifact("scale", "a", "y.txt").write_text("?")  # of the same size
    items = {f"{i.stage} {i.unit}": i for i in bring(settings(), workdir, force=True, names=("total",))}
    assert items["scale a"].why == ["corrupt: the content of y.txt has changed"]
    assert (items["scale a"].state, items["scale b"].state) == ("ran", "hit")
    assert workdir.artifact("total", "group", "z.txt").read_text() == before
    assert len(list(workdir.cache.root.glob(".quarantine/*"))) == 1


def test_of_several_that_would_read_a_changed_content_each_waits(house, workdir):
    bring(settings(), workdir, names=("source",))
    for unit in "ab":
        workdir.artifact("source", unit, "x.txt").write_text("?")
    items = {f"{i.stage} {i.unit}": i.state for i in bring(settings(), workdir)}
    assert set(items.values()) == {"ran"}
    assert workdir.artifact("total", "group", "z.txt").read_text() == "ab"


class Held:
    """Runs jobs when the walk waits for them, no sooner: all that may run at the same time do so there."""

    def __init__(self):
        self.jobs = []

    def submit(self, call, /, *args):
        future = Future()
        self.jobs.append((future, call, args))
        return future

    def wait(self, running, return_when):
        for future, call, args in self.jobs:
            future.set_result(call(*args))
        self.jobs.clear()
        return SimpleNamespace(done=set(running))


def test_an_altered_entry_is_not_taken_from_a_task_that_reads_it(house, workdir, monkeypatch):
    def run(config, inputs, out):
        (out / "y.txt").write_text(inputs.path("source", "log.txt").read_text())
        return {}

    first = SimpleNamespace(LIBS=(), INPUTS={"source": ("log.txt",)}, Config=Config, run=run)
    monkeypatch.setattr(stages, "load", lambda name: {"scale": first, "long": house.scale}.get(name, house.source))
    bring(settings(), workdir, names=("scale", "long"))
    workdir.artifact("source", "a", "x.txt").write_text("?")
    held = Held()
    monkeypatch.setattr(pipeline, "futures", SimpleNamespace(wait=held.wait, FIRST_COMPLETED=""))
    found = settings()
    wanted = graph.targets(found, ("long", "scale"), ("a",))
    items = {i.stage: i for i in pipeline.Run(found, workdir).run(wanted, held, force=True)}
    assert {name: (item.state, item.error) for name, item in items.items()} == dict.fromkeys(
        ("source", "scale", "long"), ("ran", None)
    )
    assert items["source"].why == ["corrupt: the content of x.txt has changed"]


def test_a_file_that_cannot_be_read_fails_what_stands_on_it_alone(house, workdir, monkeypatch):
    bring(settings(), workdir, names=("scale",))
    broken = workdir.artifact("source", "a", "x.txt").resolve()
    digest = pipeline.fingerprint.file_digest

    def unreadable(path):
        if path.resolve() == broken:
            raise PermissionError(13, "Permission denied")
        return digest(path)

    monkeypatch.setattr(pipeline.fingerprint, "file_digest", unreadable)
    items = {f"{i.stage} {i.unit}": i for i in bring(settings(), workdir, names=("scale",), force=True)}
    assert (items["scale a"].state, items["scale b"].state) == ("failed", "ran")
    assert "Permission denied" in items["scale a"].error.problem


def test_excluded_subjects_stop_before_the_analyses(house, workdir):
    items = bring(settings(exclude=("b",)), workdir, names=("source", "scale", "total"))
    assert set(states(items)) == {"source a", "source b", "scale a", "total group"}
    assert items[-1].summary == {"text": "a"}


def test_the_order_of_subjects_changes_nothing(house, tmp_path):
    keys = [
        {(i.stage, i.unit): i.key for i in bring(settings(subjects=order), Workdir(tmp_path / "".join(order)))}
        for order in (("a", "b"), ("b", "a"))
    ]
    assert keys[0] == keys[1]


def test_moving_the_working_folder_keeps_every_hit(house, tmp_path):
    bring(settings(), Workdir(tmp_path / "here"))
    (tmp_path / "here").rename(tmp_path / "there")
    assert set(states(bring(settings(), Workdir(tmp_path / "there"))).values()) == {"hit"}


def test_a_long_group_is_cut_into_parts_that_are_kept(house, workdir):
    first = bring(settings(), workdir, names=("long",))
    assert states(first) == {"long part-1": "ran", "long part-2": "ran", "long group": "ran"}
    assert first[-1].summary == {"units": ["part-1", "part-2"]}
    assert set(states(bring(settings(), workdir, names=("long",))).values()) == {"hit"}


@pytest.mark.parametrize(
    ("names", "subjects", "word"),
    [
        (["scale"], ["c"], "unknown subject 'c'"),
        (["scal"], [], "did you mean 'scale'"),
        (["total"], ["a"], "whole group"),
        (["scale"], ["group"], "subjects only"),
    ],
)
def test_what_does_not_exist_is_refused_with_the_names_that_do(house, names, subjects, word):
    with pytest.raises(ConfigError, match=word):
        graph.targets(settings(), names, subjects)
