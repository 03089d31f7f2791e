"""The stage robot: a simulated subject's log in, tables out."""

from __future__ import annotations

import dataclasses
import errno
import hashlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from hrcneuro.analyses import driven
from hrcneuro.arms.lock import exclusive
from hrcneuro.contract import Inputs, params
from hrcneuro.errors import ConfigError, DataError, HardwareError, StageError, StageInterrupted
from hrcneuro.io.recordings import read_stream
from hrcneuro.io.tables import describe, write_table
from hrcneuro.live.triggers import TriggerOptions
from hrcneuro.paradigm.session import SessionParams, simulate_session
from hrcneuro.robot.cell import Cell
from hrcneuro.robot.sim import Disturbance, SimArm, VirtualClock
from hrcneuro.stages import robot
from hrcneuro.tables import robot as robot_tables
from hrcneuro.tables.trials import TRIALS, study_trials


@pytest.fixture(scope="module")
def trials() -> pd.DataFrame:
    session = SessionParams(practice_episodes=1, blocks=2, episodes_per_block=2)
    return study_trials(simulate_session(session, rng=np.random.default_rng(5)), "s01", 512.0)


@pytest.fixture
def inputs(trials, tmp_path) -> Inputs:
    return given(trials, tmp_path)


def given(trials, folder) -> Inputs:
    (folder / "acquire").mkdir()
    write_table(trials, folder / "acquire" / "trials.parquet", TRIALS)
    return Inputs.of("s01", acquire=folder / "acquire")


def run(inputs, out, **changes):
    out.mkdir()
    config = dataclasses.replace(robot.Config(), **({"rescue_folder": str(out.parent / "rescue")} | changes))
    assert robot.check(config) == []
    return robot.run(config, inputs, out)


@pytest.fixture(scope="module")
def whole(trials, tmp_path_factory) -> tuple[dict, Path]:
    """Return the summary and the folder of a run over the main blocks."""
    folder = tmp_path_factory.mktemp("robot")
    return run(given(trials, folder), folder / "out"), folder / "out"


def test_the_summary_keeps_its_promises(whole, trials):
    summary, _ = whole
    assert summary["moves"] == int((~trials["practice"].astype(bool)).sum())
    assert summary["max_error_mm"] <= 0.8
    assert summary["end_error_mm"] <= 0.1
    assert 0.5 < summary["t_2mm_s"] < 1.1
    assert summary["loop_hz"] == pytest.approx(125.0)
    assert summary["jitter_p99_ms"] == pytest.approx(0.0, abs=1e-6)
    assert summary["stops"] == 0
    assert summary["lead_ms"] == pytest.approx(27.0, abs=0.5)


def test_the_arm_goes_where_the_log_went(whole, trials):
    _, out = whole
    moves = pd.read_parquet(out / "moves.parquet")
    logged = trials[~trials["practice"].astype(bool)]
    assert moves[["row", "col"]].to_numpy().tolist() == logged[["row", "col"]].to_numpy(int).tolist()
    assert moves["clamped"].to_numpy(bool).tolist() == logged["executed"].isna().tolist()
    assert np.allclose(moves["t_f_s"], logged["t_f_s"].astype(float))
    moved = moves[~moves["clamped"]]
    assert (moved["t_2mm_s"] < moved["t_f_s"]).all()
    assert moved["trigger_latency_ms"].abs().max() < 3
    assert (moved["tilt_deg"] <= 0.2).all()
    assert (moved["height_error_mm"] <= 0.8).all()


def test_telemetry_is_even_and_complete(whole):
    summary, out = whole
    telemetry = pd.read_parquet(out / "telemetry.parquet")
    assert np.allclose(np.diff(telemetry["time_s"]), 0.008)
    assert sorted(set(telemetry["move"])) == list(range(-1, summary["moves"]))
    assert set(telemetry["safety_bits"]) == {1}
    assert set(telemetry["limit_bits"]) == {0}
    moving = telemetry[telemetry["phase"] == "move"]
    assert (np.abs(moving["tool_x_m"] - moving["reference_x_m"]) < 8e-4).all()
    # The commands' own sum trails the measurement by what the arm lags behind: at most 27 ms of motion.
    assert (np.abs(moving["q_command_3_rad"] - moving["q_3_rad"]) < 0.027 * 0.9 + 1e-3).all()


def test_the_tables_carry_their_schema(whole):
    _, out = whole
    for name, table in (
        ("telemetry", robot_tables.TELEMETRY),
        ("moves", robot_tables.MOVES),
        ("timing", robot_tables.TIMING),
        ("reach", robot_tables.REACH),
    ):
        found = describe(out / f"{name}.parquet")
        assert list(found.columns) == list(table.columns)
        assert found.columns[next(iter(table.columns))].text == next(iter(table.columns.values())).text
    timing = pd.read_parquet(out / "timing.parquet").set_index("quantity")
    assert timing.loc["cycle", "mean_ms"] == pytest.approx(8.0)
    assert timing.loc["trigger_latency", "sd_ms"] < 2


def test_every_motion_has_a_marker_and_a_sample_of_the_stim_channel(whole, trials):
    """The virtual clock stands still in a cycle: a marker is there with its command, its sample at most one later."""
    _, out = whole
    moves = pd.read_parquet(out / "moves.parquet")
    moved = moves[~moves["clamped"]]
    assert (moved["marker_latency_ms"] == 0).all()
    assert (moved["marker_s"] == moved["onset_s"]).all()
    assert moved["stim_sample"].dtype.kind in "iuf"
    late = moved["stim_sample"] / 512.0 - moved["onset_s"]
    assert late.between(-2e-3 / 512, 1 / 512).all()
    assert 1e3 * late.to_numpy() == pytest.approx(moved["stim_latency_ms"].to_numpy(), abs=1e-6)
    assert moves.loc[moves["clamped"], ["marker_s", "stim_sample", "lsl_s"]].isna().all(axis=None)
    assert moves["lsl_s"].isna().all()


def test_the_reach_report_names_every_tile(whole):
    """Checked against the cell's geometry and what was measured of it: near 0.165 and 13 at the far corners."""
    _, out = whole
    reach = pd.read_parquet(out / "reach.parquet").set_index(["row", "col"])
    assert len(reach) == 49
    assert reach["singular_value"].min() == pytest.approx(0.165, abs=5e-4)
    assert reach["condition"].max() == pytest.approx(13.2, abs=0.05)
    assert reach["singular_value"].idxmin() in [(6, 0), (6, 6)]
    assert reach.loc[(0, 3), "tool_x_m"] == pytest.approx(-(0.76 + 0.035))
    assert reach.loc[(3, 0), "tool_y_m"] == pytest.approx(0.21)
    assert reach["speed_share"].between(0.1, 0.3).all()
    assert reach["speed_share"].idxmax() in [(6, 0), (6, 6), (5, 0), (5, 6)]


def test_only_numbers_are_written(whole):
    _, out = whole
    assert {p.name for p in out.iterdir()} == {f"{name}.parquet" for name in ("telemetry", "moves", "timing", "reach")}


def test_the_same_input_gives_the_same_bytes(inputs, tmp_path):
    digests = []
    for name in ("one", "two"):
        run(inputs, tmp_path / name, blocks=(1,), episodes=(1,))
        files = sorted((tmp_path / name).iterdir())
        digests.append({p.name: hashlib.sha256(p.read_bytes()).hexdigest() for p in files})
    assert digests[0] == digests[1]


def test_blocks_episodes_and_practice_are_chosen(inputs, tmp_path, trials):
    summary = run(inputs, tmp_path / "out", blocks=(1,), episodes=(1,), practice=True, t_f_s=0.6, lead_s=0.027)
    chosen = (trials["block"] == 1) & (trials["episode"] == 1)
    assert summary["moves"] == int(chosen.sum())
    moves = pd.read_parquet(tmp_path / "out" / "moves.parquet")
    assert set(moves["practice"]) == {True, False}
    assert set(moves["t_f_s"]) == {0.6}
    assert summary["max_error_mm"] <= 0.8


def test_a_foreign_study_is_refused(tmp_path):
    foreign = pd.DataFrame({"subject": ["demo"] * 3, "event": ["square"] * 3, "onset_s": [1.0, 2.0, 3.0]})
    for name in TRIALS.columns:
        if name not in foreign:
            foreign[name] = None
    with pytest.raises(DataError, match=r"no moves in the trial table \(3 rows"):
        run(given(foreign, tmp_path), tmp_path / "out")


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"blocks": (13,)}, r"robot.blocks: \[13\]"),
        ({"t_f_s": 0.1}, r"t_f 0.1 s from tile"),
        ({"cell": Cell(base_height=0.0, near_edge=1.1)}, "does not reach tile"),
    ],
)
def test_impossible_values_are_refused_before_anything_moves(inputs, tmp_path, changes, match):
    with pytest.raises(ConfigError, match=match) as caught:
        run(inputs, tmp_path / "out", **changes)
    assert caught.value.cure
    assert not (tmp_path / "rescue").exists()


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"t_f_range_s": (1.2, 0.6)}, "t_f_range_s"),
        ({"t_f_range_s": (0.6,)}, "t_f_range_s"),
        ({"cell": Cell(seed_deg=(0.0,))}, "seed_deg has 1 angles"),
        ({"cell": Cell(hover=0.005)}, "cell.hover = 0.005"),
        ({"backend": "ur"}, "needs the address"),
        ({"backend": "ur", "host": "192.168.0.10"}, "--i-am-at-the-robot"),
        ({"backend": "ur", "host": "127.a-robot.example"}, "--i-am-at-the-robot"),
        ({"backend": "ros"}, "--i-am-at-the-robot"),
        ({"markers": "lsl"}, "markers = 'lsl' with backend = 'sim'"),
        ({"backend": "ur", "host": "192.168..10"}, "host = '192.168..10' is no address"),
        ({"rescue_folder": ""}, "rescue_folder is empty"),
        ({"trigger": TriggerOptions(port="mock")}, "trigger.port = 'mock' with backend = 'sim'"),
        ({"trigger": TriggerOptions(port="serial"), "backend": "ursim"}, "needs trigger.address"),
        ({"lead_s": 0.2}, "lead_s = 0.2 is above max_lead_s = 0.05"),
        ({"patient": True, "backend": "ur", "host": "127.0.0.1"}, "a real arm is never driven on old packets"),
        ({"patient": True}, "no packets that could be late; allowed with ursim"),
        ({"patient": True, "backend": "ros", "at_the_robot": True}, "allowed with ursim"),
    ],
)
def test_contradictions_are_named(changes, match):
    assert any(match in mistake for mistake in robot.check(dataclasses.replace(robot.Config(), **changes)))


def test_another_arm_is_another_result():
    """Else a session on a simulated controller would be served as the real arm's; who stands there changes nothing."""
    simulated = robot.Config(backend="ur", host="127.0.0.9")
    real = dataclasses.replace(simulated, host="192.168.0.10")
    assert params(simulated) != params(real)
    assert params(real) == params(dataclasses.replace(real, at_the_robot=True))


def records(tmp_path) -> list[Path]:
    """Return the folders of the attempts of s01, the earliest first."""
    folder = tmp_path / "rescue" / "s01"
    return sorted(folder.iterdir(), key=lambda place: place.stat().st_ctime_ns) if folder.is_dir() else []


@pytest.fixture
def on_virtual_arm(monkeypatch):
    """Let a session of any backend drive the simulated arm, so that it takes no real time."""

    def use(*disturbances):
        def arm(config, workspace, *_):
            clock = VirtualClock()
            return SimArm(clock, workspace.home().tolist(), disturbances=disturbances), clock

        monkeypatch.setattr(robot, "_arm", arm)

    return use


@pytest.fixture
def stopped(inputs, tmp_path, on_virtual_arm):
    """Run a session on an arm with a fault; return what it raised."""

    def attempt(disturbance, **changes):
        on_virtual_arm(disturbance)
        out = tmp_path / f"out{len(list(tmp_path.glob('out*')))}"
        with pytest.raises(HardwareError) as caught:
            run(inputs, out, **({"lead_s": 0.027} | changes))
        assert not list(out.iterdir())
        return caught.value

    return attempt


@pytest.mark.parametrize("backend", ["sim", "ursim"])
def test_a_protective_stop_keeps_the_record(stopped, tmp_path, capsys, backend):
    error = stopped(Disturbance("protective_stop", 12.0), backend=backend)
    (kept,) = records(tmp_path)
    assert error.exit_code == 4
    assert "protective stop" in error.problem
    assert f"the record is in {kept}; it ended in block" in error.problem
    assert "hrcneuro never unlocks one" in str(error)
    assert "begins the session anew; robot.blocks and robot.episodes" in error.cure
    telemetry = pd.read_parquet(kept / "telemetry.parquet")
    assert telemetry["time_s"].iloc[-1] >= 12.0
    assert telemetry["safety_bits"].iloc[-1] == 4
    moves = pd.read_parquet(kept / "moves.parquet")
    assert len(moves) > 1
    assert not list(kept.glob("*.arrows")), "the tables hold it all"
    words = capsys.readouterr().err.splitlines()
    plan = re.compile(r"robot s01: \d+ moves, about \d+ (s|min) until the end; Ctrl-C stops the arm")
    assert [bool(plan.fullmatch(line)) for line in words[:1]] == [backend != "sim"]
    news = re.compile(rf"{plan.pattern}|robot s01: move \d+ of \d+, about \d+ (s|min) left")
    words = [line for line in words if not news.fullmatch(line)]
    assert "protective stop; hrcneuro never unlocks one; the arm is told to stop" in words[0]
    assert words[1].startswith("  cure: press the emergency stop if the arm moves on; find what it touched")
    assert words[2:] == ["robot s01: the arm is at rest", f"robot s01: the record is in {kept}"]


def test_no_attempt_overwrites_the_record_of_another(stopped, tmp_path):
    """Nor does one that is refused before anything moves leave an empty record."""
    stopped(Disturbance("protective_stop", 6.0), backend="ursim")
    (first,) = records(tmp_path)
    before = (first / "telemetry.parquet").read_bytes()
    refused = stopped(Disturbance("protective_stop", 0.0), backend="ursim")
    assert "record" not in refused.problem
    assert records(tmp_path) == [first]
    assert "before the first move" in stopped(Disturbance("protective_stop", 0.2), cell=Cell(home=0.1)).problem
    assert len(records(tmp_path)) == 2
    assert (first / "telemetry.parquet").read_bytes() == before


def test_what_an_arm_did_is_a_recording_and_the_entry_a_copy(inputs, tmp_path, on_virtual_arm, capsys):
    on_virtual_arm()
    summary = run(inputs, tmp_path / "out", backend="ursim", blocks=(1,), episodes=(1,))
    (place,) = records(tmp_path)
    assert {p.name for p in place.iterdir()} == {p.name for p in (tmp_path / "out").iterdir()} | {"session.json"}
    for table in (tmp_path / "out").iterdir():
        assert table.read_bytes() == (place / table.name).read_bytes()
    about = json.loads((place / "session.json").read_text())
    assert (about["subject"], about["moves"], about["robot"]["backend"]) == ("s01", summary["moves"], "ursim")
    assert f"driven to its end; its recording is in {place}" in capsys.readouterr().err
    run(inputs, tmp_path / "sim", blocks=(1,), episodes=(1,))
    assert records(tmp_path) == [place], "what sim did can be done again"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_session_driven_to_its_end_is_kept_whatever_interrupts(inputs, tmp_path, on_virtual_arm, monkeypatch, number):
    """A signal that comes while the tables are written waits until they are."""
    on_virtual_arm()
    write = driven.write_table
    monkeypatch.setattr(driven, "write_table", lambda *given: (os.kill(os.getpid(), number), write(*given)))
    before = signal.signal(number, signal.default_int_handler)
    try:
        with pytest.raises(StageInterrupted, match="driven to its end; its recording is in") as caught:
            run(inputs, tmp_path / "out", backend="ursim", blocks=(1,), episodes=(1,))
        assert signal.getsignal(number) is signal.default_int_handler
    finally:
        signal.signal(number, before)
    (place,) = records(tmp_path)
    assert str(place) in caught.value.problem
    assert len(list(place.glob("*.parquet"))) == len(list((tmp_path / "out").iterdir())) == 4


def test_a_session_whose_tables_cannot_be_written_is_still_whole(inputs, tmp_path, on_virtual_arm, monkeypatch):
    on_virtual_arm()

    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(driven, "write_table", full)
    with pytest.raises(StageError, match="No space left on device; the session was driven to its end") as caught:
        run(inputs, tmp_path / "out", backend="ursim", blocks=(1,), episodes=(1,))
    (place,) = records(tmp_path)
    assert str(place) in caught.value.problem
    rows = read_stream(place / "telemetry.arrows")
    assert np.diff(rows["time_s"]) == pytest.approx(0.008)
    assert rows["move"].max() == json.loads((place / "session.json").read_text())["moves"] - 1


def test_a_disk_without_room_is_refused_before_anything_moves(inputs, tmp_path, on_virtual_arm, monkeypatch):
    on_virtual_arm()
    usage = shutil._ntuple_diskusage(10**9, 10**9 - 10**6, 10**6)
    monkeypatch.setattr(shutil, "disk_usage", lambda place: usage)
    said = r"a session of about \d+ (s|min) may take \d+ MB in .*, where 1 MB are free; nothing has moved"
    with pytest.raises(StageError, match=said):
        run(inputs, tmp_path / "out", backend="ursim")
    assert records(tmp_path) == []


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        (
            {"approach_speed": 1.0, "approach_acceleration": 5.0, "approach_jerk": 100.0, "stop_deceleration": 0.5,
             "stop_jerk": 5.0},
            r"on the way .* the session would be stopped: a command would take the tip out of the keep-inside box",
        ),
        (
            {"approach_speed": 1.0, "approach_acceleration": 5.0, "approach_jerk": 100.0},
            "from home down to the grid the session would be stopped: a command would take the tip out of the keep-",
        ),
        ({"max_path_error_mm": 0.5}, "on the way home, up from the grid, the session .*the tip is .* mm off its path"),
        (
            {"max_path_error_mm": 0.5, "approach_speed": 0.05, "gain": 1.0},
            r"to find the lead, in the move from tile \(3, 3\) to \(4, 3\) in 0.9 s the session .* off its path",
        ),
        ({"cell": Cell(seed_deg=(350.6, -39.6, 84.7, -135.1, -90.0, -99.4))}, "it turns to ±360°"),
        ({"cell": Cell(home=0.9, ceiling=1.5)}, "does not reach its home, 0.9 m above the screen"),
    ],
)  # fmt: skip
@pytest.mark.parametrize("backend", ["sim", "ursim"])
def test_what_would_fail_in_motion_is_refused_before(inputs, tmp_path, on_virtual_arm, backend, changes, match):
    """Also what fails only until the lead is known, while the arm trails."""
    on_virtual_arm()
    with pytest.raises(ConfigError, match=match) as caught:
        run(inputs, tmp_path / "out", backend=backend, **changes)
    assert caught.value.cure
    assert records(tmp_path) == []


def test_a_record_that_cannot_be_written_hides_no_stop(stopped, tmp_path):
    (tmp_path / "file").touch()
    error = stopped(Disturbance("protective_stop", 6.0), rescue_folder=str(tmp_path / "file"))
    assert "protective stop" in error.problem
    assert "is not whole (ConfigError: the recording cannot be written" in error.problem


def test_an_arm_whose_recording_cannot_be_written_does_not_move(inputs, tmp_path, on_virtual_arm):
    on_virtual_arm()
    (tmp_path / "file").touch()
    with pytest.raises(
        ConfigError, match=r"cannot be written in .*file/s01: /.*/file is a file, not a folder; nothing has moved"
    ):
        run(inputs, tmp_path / "out", backend="ursim", rescue_folder=str(tmp_path / "file"))


def test_a_link_in_the_place_of_recordings_is_named(inputs, tmp_path, on_virtual_arm):
    on_virtual_arm()
    (tmp_path / "link").symlink_to(tmp_path / "nowhere")
    with pytest.raises(
        ConfigError, match=r"link is a link to .*nowhere, which is not there; nothing has moved"
    ) as error:
        run(inputs, tmp_path / "out", backend="ursim", rescue_folder=str(tmp_path / "link"))
    assert error.value.cure.startswith("mend or remove that link")


def test_nothing_heavy_is_imported_for_help():
    code = "import sys, hrcneuro.stages.robot; print(sorted({'numpy', 'pandas', 'ruckig', 'scipy'} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_the_lock_is_taken_by_the_session(inputs, tmp_path):
    host = f"127.2.{os.getpid() // 256 % 256}.{os.getpid() % 256}"
    with (
        exclusive("ur", host),
        pytest.raises(HardwareError, match=rf"is driven by process {os.getpid()} \(.*; nothing has moved"),
    ):
        run(inputs, tmp_path / "out", backend="ur", host=host)


def test_the_keys_that_users_write_stay_as_they_are():
    """They are declared in several classes, which a user never sees."""
    names = """
        backend driver host at_the_robot max_packet_age_s markers recorder_wait_s stim_rate_hz blocks episodes practice
        t_f_s t_f_range_s t_f_default_s start_next pause_s longest_gap_s gain damping lead_s max_acceleration
        stop_deceleration stop_jerk approach_speed approach_acceleration approach_jerk homing_speed
        homing_acceleration homing_jerk rescue_folder cell max_late_s max_lead_s max_path_error_mm
        patient trigger truth
    """
    fields = {f.name: f for f in dataclasses.fields(robot.Config)}
    assert set(fields) == set(names.split())
    assert all(f.metadata["help"] for f in fields.values())


@pytest.mark.parametrize(
    ("tiles", "match"), [((7, 1), "leaves the 7 × 7 grid"), ((0, 6), r"the log jumps from tile \(\d, \d\) to \(0, 6\)")]
)
def test_a_log_that_does_not_hang_together_is_refused(trials, tmp_path, tiles, match):
    broken = trials.copy()
    first = broken.index[~broken["practice"].astype(bool)][0]
    broken.loc[first, ["row", "col"]], broken.loc[first + 1, ["row", "col"]] = (4, 1), tiles
    with pytest.raises(DataError, match=match) as caught:
        run(given(broken, tmp_path), tmp_path / "out")
    assert "acquire the subject again" in caught.value.cure
