"""Whole sessions of the robot stage against the controller: what goes wrong ends them, and the record is kept."""

import dataclasses
import threading

import numpy as np
import pandas as pd
import pytest

from hrcneuro.contract import Inputs
from hrcneuro.errors import HardwareError
from hrcneuro.io.tables import write_table
from hrcneuro.paradigm.session import SessionParams, simulate_session
from hrcneuro.stages import robot
from hrcneuro.tables.trials import TRIALS, study_trials

QD = slice(37, 43)


@pytest.fixture
def inputs(tmp_path):
    session = SessionParams(practice_episodes=0, blocks=1, episodes_per_block=6)
    trials = study_trials(simulate_session(session, rng=np.random.default_rng(5)), "s01", 512.0)
    (tmp_path / "acquire").mkdir()
    write_table(trials, tmp_path / "acquire" / "trials.parquet", TRIALS)
    return Inputs.of("s01", acquire=tmp_path / "acquire")


@pytest.mark.parametrize("driver", ["rtde", "script"])
@pytest.mark.parametrize(
    ("fault", "part"), [("cut", "the last packet is|is not running"), ("protective_stop", "hrcneuro never unlocks one")]
)
def test_a_session_that_is_stopped_ends_and_keeps_its_record(inputs, served, stream, tmp_path, driver, fault, part):
    if driver == "rtde":
        pytest.importorskip("rtde_control", reason="ur-rtde is not installed: hrcneuro[ur]")
    one = served()
    packets = stream(one)

    def break_it():
        packets.until(lambda p: max(map(abs, p[QD])) > 0.05, seconds=60.0)
        one.fault(fault)

    breaker = threading.Thread(target=break_it)
    breaker.start()
    # Packets half a second old are safe here, so that a machine under load breaks nothing before the fault does. (The
    # watchdog may still: it has then ended the program.)
    config = dataclasses.replace(
        robot.Config(),
        backend="ur",
        host=one.address,
        driver=driver,
        max_packet_age_s=0.5,
        rescue_folder=str(tmp_path / "rescue"),
    )
    (tmp_path / "out").mkdir()
    with pytest.raises(HardwareError, match=part) as error:
        robot.run(config, inputs, tmp_path / "out")
    breaker.join()
    assert (error.value.exit_code, bool(error.value.cure)) == (4, True)
    (kept,) = (tmp_path / "rescue" / "s01").iterdir()
    telemetry = pd.read_parquet(kept / "telemetry.parquet")
    assert telemetry["time_s"].iloc[-1] - telemetry["time_s"].iloc[0] > 0.1
    assert not list((tmp_path / "out").iterdir())
    at_rest = stream(one).until(lambda p: max(map(abs, p[QD])) < 1e-3)
    stream(one).until(lambda p: p[0] > at_rest[0] + 0.5)
    assert max(map(abs, stream(one).packet()[QD])) < 1e-3
