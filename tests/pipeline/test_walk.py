"""The walk over the graph, on four toy stages: what runs, what is spared, what a failure blocks, what is drawn."""

import dataclasses
from concurrent.futures import Future

import pytest

from hrcneuro import drawings, stages
from hrcneuro.cache import fingerprint
from hrcneuro.config.settings import Settings, Shared, StudyOptions
from hrcneuro.contract import Caption, Drawing, Drawings, Of, Read, SideResult, Stage, Work, option
from hrcneuro.errors import ConfigError, DataError
from hrcneuro.pipeline import graph, sides, walk
from hrcneuro.pipeline.executors import Serial
from hrcneuro.pipeline.frontier import Ended
from hrcneuro.pipeline.workdir import Workdir


@dataclasses.dataclass(frozen=True)
class Config:
    gain: int = option(1, "multiplies")
    colour: str = option("blue", "of the picture", drawing=True)
    path: str = option("", "where", path=True, keyed=False)


def toy(name, **parts):
    return Stage(name, name.title(), Config, (), lambda config: [], **parts)


def pieces(config):
    return ("part-1", "part-2") if config.gain > 1 else ()


class House:
    """Toy stages and drawings that note what they compute."""

    def __init__(self):
        self.calls = []
        self.broken = set()
        self.libraries = ()
        self.stages = {
            "source": toy("source", subject=Work(self.source)),
            "scale": toy("scale", subject=Work(self.scale, (Read("source", ("x.txt",)),))),
            "total": toy("total", group=Work(self.total, (Read("scale", ("*.txt",), Of.INCLUDED),))),
            "long": toy(
                "long",
                group=Work(self.short),
                sides=(SideResult("sweep", pieces, self.long, ("gain",), parts=pieces, run_part=self.part),),
            ),
        }

    def draws(self, name):
        own = Drawing({"y.png": Caption("y")}, (Read("scale", ("y.txt",)),), ("scale.colour",), self.draw)
        whole = (Read("total", ("z.txt",), Of.GROUP), Read("scale", ("y.txt",), Of.INCLUDED, required=False))
        joint = Drawing({"joint.png": Caption("all")}, whole, ("total.colour",), self.draw_joint)
        return {
            "scale": Drawings("scale", self.libraries, subject=own),
            "joint": Drawings("joint", self.libraries, group=joint),
        }[name]

    def source(self, config, inputs, out):
        self.calls.append(("source", inputs.unit))
        if inputs.unit in self.broken:
            raise DataError("no recording", cure="record one")
        (out / "x.txt").write_text(inputs.unit)
        (out / "log.txt").write_text(str(config.gain))
        return {"length": len(inputs.unit)}

    def scale(self, config, inputs, out):
        self.calls.append(("scale", inputs.unit))
        (out / "y.txt").write_text(inputs.path("source", "x.txt").read_text() * config.gain)
        return {}

    def total(self, config, inputs, out):
        self.calls.append(("total", inputs.unit))
        text = "".join(inputs.path("scale", "y.txt", unit=u).read_text() for u in inputs.units("scale"))
        (out / "z.txt").write_text(text)
        return {"text": text}

    def part(self, config, inputs, out):
        self.calls.append(("long", inputs.unit))
        (out / "part.txt").write_text(inputs.unit)
        return {}

    def short(self, config, inputs, out):
        (out / "short.txt").write_text("x")
        return {}

    def long(self, config, inputs, out):
        units = inputs.units("long")
        (out / "all.txt").write_text("".join(inputs.path("long", "part.txt", unit=u).read_text() for u in units))
        return {"units": list(units)}

    def draw(self, config, files, out):
        self.calls.append(("draw", files.unit))
        if files.unit in self.broken:
            raise ValueError("no ink")
        (out / "y.png").write_text(f"{config.scale.colour} {files.path('scale', 'y.txt').read_text()}")

    def draw_joint(self, config, files, out):
        self.calls.append(("draw", "joint"))
        (out / "joint.png").write_text(f"{config.total.colour} {', '.join(files.units('scale'))}")


@pytest.fixture
def house(monkeypatch):
    house = House()
    monkeypatch.setattr(stages, "NAMES", tuple(house.stages))
    monkeypatch.setattr(stages, "load", lambda name: house.stages[name])
    monkeypatch.setattr(drawings, "STAGES", ("scale",))
    monkeypatch.setattr(drawings, "NAMES", ("scale", "joint"))
    monkeypatch.setattr(drawings, "load", lambda name: house.draws(name))
    monkeypatch.setattr(graph, "_BEFORE_EXCLUSION", ("source",))
    return house


@pytest.fixture
def workdir(tmp_path):
    return Workdir(tmp_path)


def settings(subjects=("a", "b"), exclude=(), **gains):
    sections = {name: Config(gain=gains.get(name, 1)) for name in ("source", "scale", "total", "long")}
    return Settings(StudyOptions(subjects=subjects, exclude=exclude), Shared(), sections)


def study(found, workdir, *subjects, names=("total",), pictures=False, joint=False, verify=False):
    """Return the walk over what a command asks for, and the tasks it names."""
    wanted = graph.targets(found, names, subjects)
    tasks = graph.closure(found, wanted)
    if pictures:
        tasks |= graph.pictures(found, tasks, joint=joint)
    return walk.Run(found, workdir, tasks, verify=verify), wanted


def bring(found, workdir, *subjects, force=False, executor=None, only_pictures=False, **options):
    run, wanted = study(found, workdir, *subjects, **options)
    return run.run(executor or Serial(), forced=wanted if force else (), pictures_only=only_pictures)


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
    def loud(work):
        return work and dataclasses.replace(work, run=lambda *args: (print("hello from a library"), work.run(*args))[1])

    for name, stage in house.stages.items():
        changed = dataclasses.replace(stage, subject=loud(stage.subject), group=loud(stage.group))
        monkeypatch.setitem(house.stages, name, changed)
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
    items = study(settings(), workdir)[0].plan()
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


class Late(Ended):
    """Runs jobs when the walk waits for them, no sooner: all that may run at the same time do so there."""

    def __init__(self):
        super().__init__()
        self.jobs = []

    def submit(self, call, /, *args):
        future = Future()
        self.jobs.append((future, call, args))
        return future

    def take(self):
        for future, call, args in self.jobs:
            future.set_result(call(*args))
        self.jobs.clear()
        yield from super().take()


def test_an_altered_entry_is_not_taken_from_a_task_that_reads_it(house, workdir, monkeypatch):
    def run(config, inputs, out):
        (out / "y.txt").write_text(inputs.path("source", "log.txt").read_text())
        return {}

    first = toy("scale", subject=Work(run, (Read("source", ("log.txt",)),)))
    monkeypatch.setitem(house.stages, "scale", first)
    monkeypatch.setitem(house.stages, "long", toy("long", subject=Work(house.scale, (Read("source", ("x.txt",)),))))
    bring(settings(), workdir, names=("scale", "long"))
    workdir.artifact("source", "a", "x.txt").write_text("?")
    late = Late()
    monkeypatch.setattr(walk, "Ended", lambda: late)
    items = {i.stage: i for i in bring(settings(), workdir, "a", names=("long", "scale"), force=True, executor=late)}
    assert {name: (item.state, item.error) for name, item in items.items()} == dict.fromkeys(
        ("source", "scale", "long"), ("ran", None)
    )
    assert items["source"].why == ["corrupt: the content of x.txt has changed"]


def test_a_file_that_cannot_be_read_fails_what_stands_on_it_alone(house, workdir, monkeypatch):
    bring(settings(), workdir, names=("scale",))
    broken = workdir.artifact("source", "a", "x.txt").resolve()
    digest = fingerprint.file_digest

    def unreadable(path):
        if path.resolve() == broken:
            raise PermissionError(13, "Permission denied")
        return digest(path)

    monkeypatch.setattr(fingerprint, "file_digest", unreadable)
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


def test_a_sweep_is_kept_in_pieces_and_leaves_the_group_as_it_is(house, workdir):
    assert states(bring(settings(), workdir, names=("long",))) == {"long group": "ran"}
    asked = settings(long=2)
    first = bring(asked, workdir, names=("long",))
    assert states(first) == {"long part-1": "ran", "long part-2": "ran", "long group": "hit", "long sweep": "ran"}
    assert first[-1].summary == {"units": ["part-1", "part-2"]}
    assert set(states(bring(asked, workdir, names=("long",))).values()) == {"hit"}
    assert states(bring(settings(), workdir, names=("long",))) == {"long group": "hit"}


def test_the_last_sweep_is_remembered_where_none_is_asked_for(house, workdir):
    assert sides.remembered(settings(), workdir).sections["long"].gain == 1
    bring(settings(long=2), workdir, names=("long",))
    assert sides.remembered(settings(), workdir).sections["long"].gain == 2
    assert sides.remembered(settings(long=3), workdir).sections["long"].gain == 3
    pointer = workdir.results / "sweep" / "long.json"
    pointer.write_text(pointer.read_text().replace('"gain": 2', '"gain": "two"'))
    assert sides.remembered(settings(), workdir).sections["long"].gain == 1


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


def drawn(found, workdir, **options):
    return states(bring(found, workdir, pictures=True, joint=True, **options))


def test_pictures_follow_their_numbers_as_tasks_of_their_own(house, workdir):
    first, again = drawn(settings(), workdir), drawn(settings(), workdir)
    assert first.keys() >= {"scale.figures a", "scale.figures b", "joint.figures group"}
    assert (set(first.values()), set(again.values())) == ({"ran"}, {"hit"})
    assert workdir.artifact("scale", "a", "y.png").read_text() == "blue a"
    assert workdir.artifact("scale", "a").name == workdir.pointer("scale", "a")


def test_an_option_that_only_a_picture_reads_computes_nothing(house, workdir):
    drawn(settings(), workdir)
    found = settings()
    changed = dataclasses.replace(found.sections["scale"], colour="red")
    red = dataclasses.replace(found, sections={**found.sections, "scale": changed})
    items = {f"{i.stage} {i.unit}": i for i in bring(red, workdir, pictures=True, joint=True)}
    assert {name for name, item in items.items() if item.state != "hit"} == {"scale.figures a", "scale.figures b"}
    assert items["scale.figures a"].why == ["params: scale.colour blue -> red"]
    assert workdir.artifact("scale", "a", "y.png").read_text() == "red a"


def test_another_version_of_the_drawing_library_draws_and_computes_nothing(house, workdir, monkeypatch):
    house.libraries = ("matplotlib",)
    monkeypatch.setattr(fingerprint, "version", lambda name: "3.10.7")
    drawn(settings(), workdir)
    monkeypatch.setattr(fingerprint, "version", lambda name: "3.11.0")
    items = bring(settings(), workdir, pictures=True, joint=True)
    assert {i.stage for i in items if i.state == "ran"} == {"scale.figures", "joint.figures"}
    assert {tuple(i.why) for i in items if i.draws} == {("libs: matplotlib 3.10 -> 3.11",)}


def test_a_deleted_picture_is_drawn_again_and_nothing_computed(house, workdir):
    drawn(settings(), workdir)
    workdir.artifact("scale", "a", "y.png").unlink()
    again = drawn(settings(), workdir)
    assert {name for name, state in again.items() if state != "hit"} == {"scale.figures a"}
    assert workdir.artifact("scale", "a", "y.png").is_file()


def test_a_picture_follows_an_artifact_that_changes(house, workdir):
    drawn(settings(), workdir)
    again = drawn(settings(scale=2), workdir)
    assert again["scale.figures a"] == again["joint.figures group"] == "ran"
    assert workdir.artifact("scale", "a", "y.png").read_text() == "blue aa"


def test_a_failed_drawing_fails_nobodys_numbers(house, workdir):
    bring(settings(), workdir)
    house.broken = {"a"}
    items = {f"{i.stage} {i.unit}": i for i in bring(settings(), workdir, pictures=True, joint=True)}
    assert "no ink" in items["scale.figures a"].error.problem
    assert {i.state for i in items.values() if not i.draws} == {"hit"}
    assert items["joint.figures group"].state == items["scale.figures b"].state == "ran"


def test_a_drawing_does_without_what_is_not_there(house, workdir):
    found = settings(exclude=("b",))
    drawn(found, workdir)
    assert workdir.artifact("joint.figures", "group", "joint.png").read_text() == "blue a"


def test_numbers_alone_have_no_pictures(house, workdir):
    assert not any(i.draws for i in bring(settings(), workdir))
    with pytest.raises(DataError, match=r"no file 'y\.png'"):
        workdir.artifact("scale", "a", "y.png")


def test_pictures_alone_are_drawn_of_what_is_up_to_date(house, workdir):
    bring(settings(), workdir, "a", names=("scale",))
    house.calls.clear()
    items = states(bring(settings(), workdir, pictures=True, joint=True, only_pictures=True))
    assert (items["scale a"], items["scale b"]) == ("hit", "would-run")
    assert (items["scale.figures a"], items["scale.figures b"]) == ("ran", "would-run")
    assert items["joint.figures group"] == "would-run"
    assert house.calls == [("draw", "a")]


def test_a_plan_foresees_that_a_joint_picture_is_drawn_again_with_one_more_subject(house, workdir):
    drawn(settings(subjects=("a",)), workdir)
    items = {f"{i.stage} {i.unit}": i for i in study(settings(), workdir, pictures=True, joint=True)[0].plan()}
    assert items["joint.figures group"].state == "would-run"
    assert "inputs: scale of b would run" in items["joint.figures group"].why


def test_a_joint_picture_is_not_drawn_without_what_is_merely_stale(house, workdir):
    drawn(settings(), workdir)
    sections = {**settings().sections, "total": Config(colour="red")}
    workdir.artifact("scale", "b", "y.txt").unlink()
    red = dataclasses.replace(settings(), sections=sections)
    items = states(bring(red, workdir, pictures=True, joint=True, only_pictures=True))
    assert (items["scale b"], items["joint.figures group"]) == ("would-run", "would-run")


def test_what_a_drawing_has_to_say_is_kept_with_it(house, workdir):
    def draw(config, files, out):
        (out / "y.png").write_text("")
        return {"warnings": ["no channel Czz"]}

    reads = (Read("scale", ("y.txt",)),)
    house.draws = lambda name: Drawings("scale", (), subject=Drawing({"y.png": Caption("y")}, reads, (), draw))
    items = {i.stage: i for i in bring(settings(), workdir, "a", names=("scale",), pictures=True)}
    assert items["scale.figures"].summary == {"warnings": ["no channel Czz"]}


def test_a_drawing_reads_no_option_that_it_does_not_name(house, workdir):
    def draw(config, files, out):
        (out / "y.png").write_text(config.scale.gain)

    reads = (Read("scale", ("y.txt",)),)
    house.draws = lambda name: Drawings(
        "scale", (), subject=Drawing({"y.png": Caption("y")}, reads, ("scale.colour",), draw)
    )
    items = {i.stage: i for i in bring(settings(), workdir, "a", names=("scale",), pictures=True)}
    assert "has no attribute 'gain'" in items["scale.figures"].error.problem


def slim(workdir, items, stage, name):
    """Drop a file of a stage's entries, and note it, as ``cache slim`` does."""
    for item in items:
        if item.stage == stage:
            folder = workdir.cache.folder(item.stage, item.unit, item.key)
            (folder / ".slim").write_text(f'["{name}"]')
            (folder / name).unlink()


def test_an_entry_whose_files_were_dropped_is_a_hit_while_nobody_reads_them(house, workdir):
    first = bring(settings(), workdir)
    slim(workdir, first, "source", "x.txt")
    again = bring(settings(), workdir)
    assert set(states(again).values()) == {"hit"}
    assert [i.artifacts.keys() for i in again if i.stage == "source"] == [{"log.txt"}] * 2
    assert [i.summary for i in first] == [i.summary for i in again]


def test_what_reads_a_dropped_file_makes_it_again_and_nothing_else(house, workdir):
    first = bring(settings(), workdir)
    slim(workdir, first, "source", "x.txt")
    slim(workdir, first, "scale", "y.txt")
    foreseen, _ = study(settings(total=2), workdir)
    assert states(foreseen.plan()) == dict.fromkeys(states(first), "would-run")
    house.calls.clear()
    done = bring(settings(total=2), workdir)
    assert states(done) == dict.fromkeys(states(first), "ran")
    assert len(house.calls) == 5
    assert done[0].why == ["dropped to save disk: x.txt"]
    assert not workdir.cache.quarantined()
    assert set(states(bring(settings(), workdir)).values()) == {"hit"}


def test_a_dropped_file_is_made_again_only_for_the_unit_that_reads_it(house, workdir):
    first = bring(settings(), workdir)
    slim(workdir, first, "source", "x.txt")
    done = bring(settings(scale=2), workdir, "a", names=("scale",))
    assert states(done) == {"source a": "ran", "scale a": "ran"}
    after = bring(settings(), workdir)
    assert set(states(after).values()) == {"hit"}
    assert {i.unit: sorted(i.artifacts) for i in after if i.stage == "source"} == {
        "a": ["log.txt", "x.txt"],
        "b": ["log.txt"],
    }


def test_who_asks_for_a_stage_gets_all_its_files(house, workdir):
    first = bring(settings(), workdir)
    slim(workdir, first, "source", "x.txt")
    found = settings()
    wanted = graph.targets(found, ("source",), ("a",))
    run = walk.Run(found, workdir, graph.closure(found, wanted), whole=wanted)
    assert states(run.plan()) == {"source a": "would-run"}
    run = walk.Run(found, workdir, graph.closure(found, wanted), whole=wanted)
    (item,) = run.run(Serial())
    assert (item.state, sorted(item.artifacts)) == ("ran", ["log.txt", "x.txt"])


def test_a_file_that_is_gone_without_a_word_is_a_flaw_also_beside_dropped_ones(house, workdir):
    first = bring(settings(), workdir)
    slim(workdir, first, "source", "x.txt")
    (workdir.cache.folder("source", "a", first[0].key) / "log.txt").unlink()
    done = bring(settings(), workdir)
    assert done[0].state == "ran"
    assert "log.txt is missing" in done[0].why[0]
