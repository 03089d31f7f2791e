"""The pictures of simulate, drawn from the tables that the stage has written."""

from types import SimpleNamespace

import pytest

from hrcneuro.contract import Inputs
from hrcneuro.drawings import simulate as drawing
from hrcneuro.stages import simulate

SMALL = simulate.Config(repetitions=20, episodes=12, period=5, learner_repetitions=10, sweep_repetitions=10)
SWEEP = {"accuracy": (55.0, 80.0), "period": (0.0, 4.0), "alpha": (0.05, 0.2)}


def computed(folder, **changes):
    """Return the configuration and the group's files."""
    from dataclasses import replace

    config = replace(SMALL, **changes)
    parts = {unit: folder / unit for unit in simulate.parts(config)}
    for unit, where in parts.items():
        where.mkdir()
        simulate.run_part(config, Inputs(unit, {}), where)
    group = folder / "group"
    group.mkdir()
    simulate.run_group(config, Inputs.of("group", simulate=parts), group)
    return SimpleNamespace(simulate=config), Inputs.of("group", simulate=group)


def drawn(config, files, out):
    out.mkdir()
    drawing.DRAWINGS.group.draw(config, files, out)
    return {p.name: p.read_bytes() for p in out.iterdir()}


def test_every_picture_is_drawn_from_the_tables_and_with_the_same_bytes_again(tmp_path):
    config, files = computed(tmp_path, sweep=SWEEP)
    options = {name.removeprefix("simulate.") for name in drawing.DRAWINGS.group.options}
    given = SimpleNamespace(simulate=SimpleNamespace(**{name: getattr(config.simulate, name) for name in options}))
    found = drawn(given, files, tmp_path / "one")
    names = set(drawing.DRAWINGS.group.captions)
    assert set(found) == names | {name.replace(".png", ".pdf") for name in names}
    assert drawn(given, files, tmp_path / "two") == found


@pytest.mark.parametrize(
    "changes",
    [
        {"episodes": 1, "test_cases": (), "levels": ()},
        {"learner_repetitions": 0, "test_cases": ()},
        {"confound": False, "reassign": "once", "test_cases": ((6, 3),)},
    ],
)
def test_only_what_was_computed_is_drawn(tmp_path, changes):
    config, files = computed(tmp_path, **changes)
    wanted = {"fig4.png"}
    wanted |= {"learners.png"} if config.simulate.learner_repetitions else set()
    wanted |= {"confound.png"} if config.simulate.confound else set()
    assert {name for name in drawn(config, files, tmp_path / "out") if name.endswith(".png")} == wanted
