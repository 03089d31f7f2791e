"""The pictures of simulate, drawn from the tables that the stage has written."""

from types import SimpleNamespace

import pytest

from hrcneuro.contract import Inputs
from hrcneuro.drawings import simulate as drawing
from hrcneuro.stages import simulate
from tests.helpers import gaze_logs

SMALL = simulate.Config(repetitions=20, episodes=12, period=5, learner_repetitions=10, sweep_repetitions=10)
SWEEP = {"accuracy": (55.0, 80.0), "period": (0.0, 4.0), "alpha": (0.05, 0.2)}


def computed(folder, **changes):
    """Return the configuration, the group's files and the sweep's."""
    from dataclasses import replace

    config = replace(SMALL, **changes)
    group = folder / "group"
    group.mkdir()
    simulate.run_group(config, Inputs("group", {}), group)
    return SimpleNamespace(simulate=config), Inputs.of("group", simulate=group)


def swept(folder, **axes):
    """Return the configuration and the sweep's files."""
    from dataclasses import replace

    config = replace(SMALL, sweep=axes)
    parts = {unit: folder / unit for unit in simulate.parts(config)}
    for unit, where in parts.items():
        where.mkdir()
        simulate.run_part(config, Inputs(unit, {}), where)
    out = folder / "sweep"
    out.mkdir()
    simulate.run_sweep(config, Inputs.of("sweep", simulate=parts), out)
    options = {name.removeprefix("simulate.") for name in drawing.DRAWINGS.sides["sweep"].options}
    given = SimpleNamespace(simulate=SimpleNamespace(**{name: getattr(config, name) for name in options}))
    return given, Inputs.of("sweep", simulate=out)


def drawn(config, files, out, which="group"):
    out.mkdir()
    drawing.DRAWINGS.of(which).draw(config, files, out)
    return {p.name: p.read_bytes() for p in out.iterdir()}


def test_every_picture_is_drawn_from_the_tables_and_with_the_same_bytes_again(tmp_path):
    _, files = computed(tmp_path)
    found = drawn(None, files, tmp_path / "one")
    names = set(drawing.DRAWINGS.group.captions)
    assert set(found) == names | {name.replace(".png", ".pdf") for name in names}
    assert drawn(None, files, tmp_path / "two") == found


def test_a_sweep_is_drawn_with_the_same_bytes_again(tmp_path):
    given, files = swept(tmp_path, **SWEEP)
    found = drawn(given, files, tmp_path / "one", "sweep")
    assert set(found) == {"sweep.png", "sweep.pdf"}
    assert drawn(given, files, tmp_path / "two", "sweep") == found


@pytest.mark.parametrize("partners", [("fixed", "adapting"), ("adapting",)])
def test_evidence_is_drawn_with_the_same_bytes_again_whoever_guesses(tmp_path, partners):
    config = simulate.Config(evidence=str(tmp_path / "logs"), evidence_repetitions=5, evidence_partners=partners)
    gaze_logs.write_study(tmp_path / "logs", subjects=2)
    made = tmp_path / "evidence"
    made.mkdir()
    simulate.run_evidence(config, Inputs("evidence", {}), made)
    files = Inputs.of("evidence", simulate=made)
    found = drawn(None, files, tmp_path / "one", "evidence")
    assert set(found) == {"evidence.png", "evidence.pdf"}
    assert drawn(None, files, tmp_path / "two", "evidence") == found


@pytest.mark.parametrize(
    "axes",
    [
        {"accuracy": (55.0, 80.0)},
        {"accuracy": (55.0,)},
        {"alpha": (0.01, 0.2)},
        {"period": (0.0, 4.0)},
        {"alpha": (0.01, 0.2), "subtasks": (2.0, 4.0)},
        {"accuracy": (50.0, 51.0), "tau": (0.1, 0.2)},
        {"subtasks": (2.0, 4.0), "chosen": (1.0, 2.0, 3.0)},
    ],
    ids=lambda axes: " ".join(axes),
)
def test_every_sweep_has_a_picture_with_lines_or_areas_in_each_panel(tmp_path, monkeypatch, axes):
    from hrcneuro.figures import sweep

    kept = []
    monkeypatch.setattr(sweep, "save", lambda figure, path: kept.append(figure))
    given, files = swept(tmp_path, **axes)
    drawn(given, files, tmp_path / "out", "sweep")
    panels = [axes for axes in kept[0].axes if axes.get_xlabel()]
    assert panels
    assert all(panel.lines or panel.collections for panel in panels)


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
