"""The arm's pictures come from its tables alone: what is drawn of a session on the in-process arm."""

import dataclasses
import hashlib
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from hrcneuro.contract import Inputs, chosen
from hrcneuro.drawings import moves, robot
from hrcneuro.figures import robot as figure_of
from hrcneuro.io.tables import read_table, write_table
from hrcneuro.paradigm.session import SessionParams, simulate_session
from hrcneuro.stages import robot as stage
from hrcneuro.tables.trials import TRIALS, study_trials


@pytest.fixture(scope="module")
def folders(tmp_path_factory) -> dict[str, Path]:
    """Return the folders of an entry of acquire and of one of robot, of the same subject."""
    folder = tmp_path_factory.mktemp("arm")
    session = SessionParams(practice_episodes=0, blocks=2, episodes_per_block=1)
    trials = study_trials(simulate_session(session, rng=np.random.default_rng(5)), "s01", 512.0)
    for name in ("acquire", "robot"):
        (folder / name).mkdir()
    write_table(trials, folder / "acquire" / "trials.parquet", TRIALS)
    config = dataclasses.replace(stage.Config(), lead_s=0.027)
    stage.run(config, Inputs.of("s01", acquire=folder / "acquire"), folder / "robot")
    return {name: folder / name for name in ("acquire", "robot")}


def options(**changes):
    sections = {"robot": dataclasses.replace(stage.Config(), **changes)}
    return chosen(sections, robot.DRAWINGS.subject.options)


def drawn(folder: Path) -> dict[str, str]:
    return {p.name: hashlib.sha256(p.read_bytes()).hexdigest() for p in folder.glob("*.png")}


@pytest.fixture(scope="module")
def pictures(folders, tmp_path_factory) -> Path:
    """Return the folder of a session's pictures, drawn once."""
    folder = tmp_path_factory.mktemp("pictures")
    robot.draw(options(), Inputs.of("s01", robot=folders["robot"]), folder)
    return folder


def test_every_picture_is_drawn_and_comes_out_the_same_again(folders, pictures, tmp_path):
    robot.draw(options(), Inputs.of("s01", robot=folders["robot"]), tmp_path)
    found = drawn(tmp_path)
    assert set(found) == set(robot.DRAWINGS.subject.captions)
    assert {p.stem for p in tmp_path.glob("*.pdf")} == {Path(name).stem for name in found}
    assert found == drawn(pictures)


def test_behind_sockets_the_limit_is_another(folders, pictures, tmp_path):
    """Only the picture that shows the limit changes; the cell's own changes with the cell."""
    cell = dataclasses.replace(stage.Config().cell, near_edge=0.7)
    before, after = drawn(pictures), {}
    for name, changes in (("ursim", {"backend": "ursim"}), ("cell", {"cell": cell})):
        (tmp_path / name).mkdir()
        robot.draw(options(**changes), Inputs.of("s01", robot=folders["robot"]), tmp_path / name)
        after[name] = drawn(tmp_path / name)
    assert {name for name, digest in before.items() if after["ursim"][name] != digest} == {"robot.png"}
    assert after["cell"]["timing.png"] == before["timing.png"]
    assert after["cell"]["reach.png"] != before["reach.png"]


def test_a_session_without_a_finished_move_is_drawn(folders, tmp_path):
    """What was recorded of a session that was stopped before its first move ended."""
    (tmp_path / "robot").mkdir()
    for place in folders["robot"].iterdir():
        table = pd.read_parquet(place)
        if place.name == "moves.parquet":
            table = table.iloc[:0]
        if place.name == "timing.parquet":
            table = table[table["quantity"].isin(["cycle", "cycle_jitter"])]
        table.to_parquet(tmp_path / "robot" / place.name)
    (tmp_path / "out").mkdir()
    robot.draw(options(), Inputs.of("s01", robot=tmp_path / "robot"), tmp_path / "out")
    # On a virtual clock nothing of its timing is left to show.
    assert set(drawn(tmp_path / "out")) == set(robot.DRAWINGS.subject.captions) - {"timing.png"}


@pytest.mark.parametrize("real", [True, False])
def test_timing_shows_cycles_and_markers_only_where_a_clock_runs(folders, real):
    tables = {name: read_table(folders["robot"] / f"{name}.parquet") for name in ("telemetry", "moves", "timing")}
    if real:
        rng = np.random.default_rng(1)
        tables["telemetry"]["time_s"] += rng.uniform(0, 1e-3, len(tables["telemetry"]))
        tables["moves"]["marker_latency_ms"] = rng.uniform(0.1, 0.3, len(tables["moves"]))
    else:
        tables["moves"][["marker_latency_ms", "stim_latency_ms"]] = 1e-9
    panels, note = figure_of._timing_panels(tables["telemetry"], tables["moves"], tables["timing"])
    ours = {"onset commanded to marker", "control cycle", "cycles in the session"}
    assert (ours <= {title for title, _ in panels}) == real
    assert bool(ours & {title for title, _ in panels}) == real
    assert ("a virtual clock: every control cycle lasts 8 ms" in note) == (not real)


@pytest.mark.parametrize("counts", [True, False])
def test_the_median_ends_below_the_numbers_of_a_distribution(counts):
    values = np.linspace(-1.0, 1.0, 50) + 0.8  # the median lies below the text
    axes = Figure(figsize=(2.7, 2.0)).subplots()
    spread = {"median": 1.5, "mean": 0.8, "sd": 0.5, "p1": -0.2, "p99": 1.8}
    figure_of._histogram(axes, values, spread, counts=counts)
    (line,), (text,) = axes.get_lines(), axes.texts
    end = axes.transAxes.transform((0, line.get_ydata()[1]))[1]
    assert end < text.get_window_extent().y0


def test_the_moves_of_all_subjects_are_joined(folders, tmp_path):
    inputs = Inputs.of(
        "group", acquire=dict.fromkeys(("s01", "s02"), folders["acquire"]), robot={"s01": folders["robot"]}
    )
    moves.draw(options(), inputs, tmp_path)
    assert set(drawn(tmp_path)) == set(moves.DRAWINGS.group.captions)


def test_where_no_arm_has_moved_there_is_no_picture(folders, tmp_path):
    moves.draw(options(), Inputs.of("group", acquire={"s01": folders["acquire"]}), tmp_path)
    assert not list(tmp_path.iterdir())
