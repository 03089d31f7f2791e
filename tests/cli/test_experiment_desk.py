"""What the experimenter is told of a session: whether it is recorded, how large the grid is."""

import math

import pytest
from rich.console import Console as Rich

from hrcneuro.cli import experimenting
from hrcneuro.cli.console import Console
from hrcneuro.cli.experiment_desk import Desk
from hrcneuro.experiment.parameters import ExperimentOptions
from hrcneuro.experiment.ports import Seen
from hrcneuro.experiment.session import Setup
from hrcneuro.experiment.window.requests import Opened
from hrcneuro.paradigm.params import SessionParams, TimingParams
from hrcneuro.stages.robot import Config


@pytest.mark.parametrize("state", ["yes", "no", "lost"])
def test_whether_it_is_recorded_is_told_while_it_runs_and_at_its_end(state, tmp_path):
    seen = Seen(recorded=state)
    screen = Rich(width=100)
    with screen.capture() as caught:
        screen.print(Desk(Console(), 12)._table(seen))
    assert ["recorded", state] in [line.split() for line in caught.get().splitlines()]
    setup = Setup("s01", ExperimentOptions(), SessionParams(), TimingParams(), 1, Config(), tmp_path)
    assert any(line.strip().startswith(f"recorded: {state}") for line in experimenting.lines(setup, seen))
    assert experimenting.told(setup, seen)["recorded"] == state


def test_the_size_of_the_grid_is_told_with_its_source_and_what_sets_it():
    opened = Opened("x11", (1920, 1080), 20.65, "said by the screen", 144.5)
    text = opened.told(0.5)
    for part in ("20.65 pixels per cm", "said by the screen", "24.5 cm", "experiment.window.pixels_per_cm"):
        assert part in text
    assert opened.about["pixels_per_cm"] == 20.65
    fitted = Opened("x11", (1920, 1080), math.nan, "as large as fits", 100.0)
    assert "not of true size" in fitted.told(0.0)
    assert fitted.about["pixels_per_cm"] is None
