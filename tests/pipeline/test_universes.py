"""Universes over toy stages: what they share, in which order they run, what they cost, what may go when."""

import dataclasses

import pytest

from hrcneuro import stages
from hrcneuro.cache import fingerprint
from hrcneuro.config.settings import Settings, Shared, StudyOptions
from hrcneuro.contract import Of, Read, Sessions, Stage, Work, option
from hrcneuro.errors import ConfigError
from hrcneuro.pipeline import graph, universe_cost, universes, walk
from hrcneuro.pipeline.beside import Beside
from hrcneuro.pipeline.executors import Serial
from hrcneuro.pipeline.keys import Keys
from hrcneuro.pipeline.workdir import Workdir

LARGE = 2_000_000


@dataclasses.dataclass(frozen=True)
class Config:
    gain: int = option(1, "multiplies")


class House:
    """acquire -> preprocess -> erp, which has a group; each writes a signal, a large table and a small one."""

    def __init__(self):
        self.calls = []
        self.sessions = Sessions.SIDE_BY_SIDE
        reads = {"preprocess": (Read("acquire", ("*.fif",)),), "erp": (Read("preprocess", ("*.fif",)),)}
        group = Work(self.work, (Read("erp", ("*.parquet",), Of.INCLUDED),))
        self.stages = {
            name: Stage(
                name,
                name,
                Config,
                (),
                lambda config: [],
                subject=Work(self.work, reads.get(name, ())),
                group=group if name == "erp" else None,
                sessions=lambda config: self.sessions,
            )
            for name in ("acquire", "preprocess", "erp")
        }

    def work(self, config, inputs, out):
        self.calls.append((inputs.unit, config.gain))
        (out / "x.fif").write_bytes(bytes([config.gain]) * LARGE)
        (out / "z_stats.parquet").write_bytes(bytes([config.gain]) * LARGE)
        of = [
            path.read_bytes()[:1] for units in inputs.files.values() for own in units.values() for path in own.values()
        ]
        (out / "y.parquet").write_text(f"{config.gain} of {of}")
        return {}


@pytest.fixture
def house(monkeypatch):
    house = House()
    monkeypatch.setattr(stages, "NAMES", tuple(house.stages))
    monkeypatch.setattr(stages, "load", lambda name: house.stages[name])
    # The code of the real stages, which have these names, is none of the toys'.
    monkeypatch.setattr(fingerprint, "code", lambda module, root, memo: {module: "as it is"})
    return house


@pytest.fixture
def study(tmp_path):
    return Workdir(tmp_path / "study")


@pytest.fixture
def place(study):
    return Beside(study, study.folder / "multiverse")


def settings(**gains):
    sections = {name: Config(gains.get(name, 1)) for name in ("acquire", "preprocess", "erp")}
    return Settings(StudyOptions(subjects=("s01", "s02"), exclude=()), Shared(), sections)


def made(place, *gains):
    keys = Keys(settings(), place)
    names = ("acquire", "preprocess", "erp")
    return [universes.universe(n, {}, settings(**one), names, keys) for n, one in enumerate(gains)]


def run(place, one):
    return walk.Run(one.settings, place, one.graph).run(Serial())


def finish(place, study, every):
    """Run universes one after the other, and let go as the command does; return how large the cache was at most."""
    last, most = universes.last_uses(every), 0
    for one in every:
        items = run(place, one)
        assert all(item.state.done for item in items)
        most = max(most, sum(path.stat().st_size for path in large(place)))
        over = {lineage[:2] for lineage in one.lineages.values() if last[lineage] == one.number}
        universes.let_go(place, study, [item for item in items if (item.stage, item.unit) in over])
    return most


def signals(place):
    return sorted(place.cache.root.rglob("*.fif"))


def large(place):
    return sorted(path for path in place.cache.root.rglob("*.*") if path.stat().st_size >= LARGE)


def test_tasks_of_one_lineage_are_those_that_the_cache_shares(house, place):
    one, two, three = made(place, {}, {"erp": 2}, {"preprocess": 2})
    assert one.of("preprocess") == two.of("preprocess") != three.of("preprocess")
    assert one.of("acquire") == three.of("acquire")
    assert not set(one.of("erp")) & set(two.of("erp"))
    assert not set(one.of("erp")) & set(three.of("erp"))
    assert len({one.id, two.id, three.id}) == 3
    keys = {one.number: {(i.stage, i.unit, i.key) for i in run(place, one)} for one in (one, two, three)}
    for a, b in ((one, two), (one, three), (two, three)):
        shared = set(a.lineages.values()) & set(b.lineages.values())
        assert {lineage[:2] for lineage in shared} == {entry[:2] for entry in keys[a.number] & keys[b.number]}


def test_each_shared_step_is_computed_once(house, place, study):
    every = made(place, *({"preprocess": p, "erp": e} for p in (1, 2) for e in (1, 2, 3)))
    finish(place, study, universes.in_order(every))
    assert len(house.calls) == len({lineage for one in every for lineage in one.lineages.values()}) == 2 + 4 + 6 * 3


def test_universes_of_a_chain_follow_each_other_and_the_study_s_own_comes_first(house, place):
    every = made(place, {}, {"preprocess": 2}, {"erp": 2}, {"preprocess": 2, "erp": 2}, {"acquire": 2}, {"erp": 3})
    assert [one.number for one in universes.in_order(every)] == [0, 2, 5, 1, 3, 4]
    assert universes.chains(every) == {0: 0, 1: 1, 2: 0, 3: 1, 4: 2, 5: 0}


def test_signals_go_after_their_last_use_and_nothing_is_computed_twice_for_that(house, place, study):
    every = universes.in_order(made(place, *({"preprocess": p, "erp": e} for e in (1, 2) for p in (1, 2, 3))))
    most = finish(place, study, every)
    # Two subjects' recordings, one chain and one variant of erp, and its group: a signal and a large table of each;
    # beside them stay the tests of the six groups, which verdicts are passed on.
    assert most <= (2 * (2 + 2 + 2 + 1) + 6) * LARGE
    assert [(*path.parts[-4:-2], path.name) for path in large(place)] == 6 * [("erp", "group", "z_stats.parquet")]
    assert len(list(place.cache.root.rglob("y.parquet"))) == 2 + 3 * 2 + 6 * 3
    before = len(house.calls)
    for one in every:
        assert {item.state for item in run(place, one)} == {"hit"}
    assert len(house.calls) == before


def test_what_the_study_or_another_one_holds_stays(house, place, study, tmp_path):
    own = settings()
    tasks = graph.closure(own, graph.targets(own, ("acquire", "preprocess", "erp"), ()))
    walk.Run(own, study, tasks).run(Serial())
    pointers = {path: path.read_text() for path in study.results.rglob("*.json")}
    every = made(place, {}, {"preprocess": 2}, {"preprocess": 3})
    other = Workdir(tmp_path / "other", study.cache.root)
    other_own = settings(preprocess=2)
    finish(place, study, every[:2])
    assert not [path for path in signals(place) if path.parts[-4] == "preprocess" and path.read_bytes()[0] == 2]
    # Another study now wants what this one has let go, and holds it.
    walk.Run(other_own, other, tasks, whole=[t for t in tasks if t.name == "preprocess"]).run(Serial())
    finish(place, study, every)
    held = {(path.parts[-4], path.read_bytes()[0]) for path in signals(place)}
    assert held == {("acquire", 1), ("preprocess", 1), ("erp", 1), ("preprocess", 2)}
    assert {path: path.read_text() for path in study.results.rglob("*.json")} == pointers
    assert {item.state for item in walk.Run(own, study, tasks, verify=True).plan()} == {"hit"}


def test_what_another_configuration_of_the_study_made_stays_though_nothing_points_at_it(house, place, study):
    for own in (settings(preprocess=2), settings()):
        tasks = graph.closure(own, graph.targets(own, ("acquire", "preprocess", "erp"), ()))
        walk.Run(own, study, tasks).run(Serial())
    finish(place, study, made(place, {}, {"preprocess": 2}))
    assert {path.read_bytes()[0] for path in signals(place) if path.parts[-4] == "preprocess"} == {1, 2}


def costs(place, study, every, pending=None, limit=None):
    pending = universes.in_order(every if pending is None else pending)
    chains = len(set(universes.chains(every).values()))

    def plan(one):
        return walk.Run(one.settings, place, one.graph).plan()

    return universe_cost.cost(study, every, pending, plan, chains=chains, limit=limit)


def test_what_it_will_cost_is_what_it_costs(house, place, study, monkeypatch):
    monkeypatch.setattr(universe_cost, "estimate", lambda *task: None)
    every = made(place, *({"preprocess": p, "erp": e} for p in (1, 2) for e in (1, 2, 3)))
    first = costs(place, study, every)
    assert (first.universes, first.chains, first.judged, first.units, first.there) == (6, 2, 0, 24, 0)
    assert first.shared == 6 * 7 - 24
    assert (first.untimed, first.seconds) == (("acquire", "preprocess", "erp"), 0.0)
    assert "nothing has run yet" in "\n".join(first.lines())
    # One universe has run: now every kind is known.
    own = made(place, {})[0]
    walk.Run(own.settings, study, own.graph).run(Serial())
    wanted = costs(place, study, every)
    assert (wanted.units, wanted.there, wanted.untimed, wanted.unsized) == (24 - 7, 7, (), ())
    before = {path: path.stat().st_size for path in place.cache.root.rglob("*") if path.suffix in (".fif", ".parquet")}
    most = finish(place, study, universes.in_order(every))
    held = sum(size for size in before.values() if size >= LARGE)
    assert wanted.disk == pytest.approx(most - held, abs=1000)
    after = sum(path.stat().st_size for path in place.cache.root.rglob("*") if path.suffix in (".fif", ".parquet"))
    assert wanted.kept == pytest.approx(after - sum(before.values()), abs=1000)
    assert costs(place, study, every, pending=[]).units == 0


def test_a_disk_that_is_too_small_is_refused_with_the_cure(house, place, study):
    own = made(place, {})[0]
    walk.Run(own.settings, study, own.graph).run(Serial())
    every = made(place, {}, {"preprocess": 2})
    needed = costs(place, study, every).disk
    costs(place, study, every, limit=needed).refuse()
    with pytest.raises(ConfigError) as caught:
        costs(place, study, every, limit=needed - 1).refuse()
    assert "--disk allows" in caught.value.problem
    assert "nothing has run" in caught.value.problem
    full = dataclasses.replace(costs(place, study, every), free=needed - 1)
    with pytest.raises(ConfigError) as caught:
        full.refuse()
    assert "are free" in caught.value.problem
    assert "hrcneuro cache slim" in caught.value.cure


def test_an_arm_that_moves_in_real_time_is_no_part_of_a_multiverse(house, place):
    @dataclasses.dataclass(frozen=True)
    class Arm(Config):
        backend: str = "ur"

    house.sessions = Sessions.ONE_A_COMMAND
    sections = {name: Arm() for name in house.stages}
    with pytest.raises(ConfigError, match="drives one arm in real time"):
        universes.universe(0, {}, dataclasses.replace(settings(), sections=sections), ("erp",), Keys(settings(), place))
