"""The log of an experiment: what is written as it goes comes back; what is broken off goes on; nothing is lost."""

import contextlib
import errno
import json
import os
import subprocess
import sys
import time
from datetime import datetime, timedelta
from pathlib import Path

import killed_writers
import numpy as np
import pandas as pd
import pytest
from experiment_log import OPTIONS, SHORT, Clock, begun, move_of, play, simulated

from hrcneuro.errors import ConfigError, DataError, HardwareError, StageError
from hrcneuro.experiment import disk
from hrcneuro.experiment.log import Log
from hrcneuro.experiment.mending import TORN
from hrcneuro.io.tables import read_table
from hrcneuro.paradigm.owners import Areas, Directions
from hrcneuro.paradigm.retrace import retrace
from hrcneuro.paradigm.session import Block, protocol
from hrcneuro.sources import authors_log, behaviour, experiments
from hrcneuro.sources.logs import read_log
from hrcneuro.stages import acquire

LOGS = Path(__file__).parents[2] / "../shared/data/HRC_neurobased_taskplanning"
TIMES = ["onset_s", "soa_s", "t_f_s", "onset_sample"]


@pytest.fixture(scope="module")
def trials():
    return simulated()


def lines_of(folder, kind=""):
    entries, _ = experiments.read(folder / "s01" / experiments.FILE)
    return [entry for entry in entries if kind in ("", entry["kind"])]


def same(table, trials, *, but=TIMES):
    """Hold that two tables of moves are equal in all columns that both can have."""
    columns = [name for name in trials if name not in but]
    pd.testing.assert_frame_equal(
        table[columns].astype(object).where(table[columns].notna(), None).reset_index(drop=True),
        trials[columns].astype(object).where(trials[columns].notna(), None).reset_index(drop=True),
        check_dtype=False,
    )


def pair_follows_from_the_rows(folder):
    """Hold that both CSV files are what their own moves, read again, come to, byte for byte."""
    home, trials = folder / "s01", read_log(folder, "s01")
    assert (home / "subject01.csv").read_text() == authors_log.log_head() + "".join(
        map(authors_log.log_line, trials.itertuples())
    )
    assert len(trials) == len(lines_of(folder, experiments.MOVE))
    return trials


def test_a_session_comes_back_whole(tmp_path, trials):
    with begun(tmp_path) as log:
        play(log, trials)
        log.close(complete=True)
    same(pair_follows_from_the_rows(tmp_path), trials)
    table = read_table(tmp_path / "s01" / "trials.parquet")
    same(table, trials)
    np.testing.assert_allclose(table["onset_s"], trials["onset_s"], atol=1e-6)
    np.testing.assert_allclose(table["t_f_s"], trials["t_f_s"], atol=1e-6)
    assert table["onset_sample"].isna().all()
    assert (table["subject"] == "s01").all()
    moves = pd.DataFrame(lines_of(tmp_path, experiments.MOVE))
    same(moves, trials[[name for name in trials if name in moves]])
    ends = lines_of(tmp_path, experiments.BLOCK_END)
    assert [(one["practice"], one["block"]) for one in ends] == [(b.practice, b.number) for b in protocol(SHORT)]
    assert ends[-1]["counted"]["moves"] == len(trials)
    assert ends[-1]["counted"]["errors"] == trials["error"].sum()
    assert ends[-1]["counted"]["wrong_keys"] == trials["key_wrong"].sum()


def test_when_the_tool_came_within_its_radius_is_counted_as_the_onset_is(tmp_path, trials):
    with begun(tmp_path) as log:
        play(log, trials, most=1)
        row = trials.iloc[1]
        log.move(move_of(row), onset=2000.0, t_f=0.8, radius=2000.6, ended=2000.8)
    first, second = lines_of(tmp_path, experiments.MOVE)
    assert "radius_s" not in first
    assert second["radius_s"] - second["onset_s"] == pytest.approx(0.6, abs=1e-6)


def test_a_persons_log_has_the_authors_columns_and_a_simulated_one_says_so(tmp_path, trials):
    for simulated_human, folder in ((False, tmp_path / "person"), (True, tmp_path / "made")):
        with begun(folder, simulated=simulated_human) as log:
            play(log, trials)
        columns = (folder / "s01" / "metadata01.csv").read_text().splitlines()[0]
        assert columns.endswith("Total correct %" + ",Origin" * simulated_human)
        again = folder / "again.csv"
        authors_log.write_metadata(read_log(folder, "s01"), again)
        if not simulated_human:
            assert again.read_bytes() == (folder / "s01" / "metadata01.csv").read_bytes()


@pytest.mark.parametrize("number", range(1, 13))
def test_the_published_logs_are_written_byte_for_byte(tmp_path, number):
    if not LOGS.is_dir():
        pytest.skip("the published logs are not at hand")
    subject = f"s{number:02d}"
    trials = read_log(LOGS, subject)
    authors_log.write_log(trials, tmp_path / "log")
    authors_log.write_metadata(trials, tmp_path / "metadata")
    assert (tmp_path / "log").read_bytes() == (LOGS / subject / f"subject{subject[1:]}.csv").read_bytes()
    assert (tmp_path / "metadata").read_bytes() == (LOGS / subject / f"metadata{subject[1:]}.csv").read_bytes()


def test_after_each_move_the_pair_is_whole_up_to_it(tmp_path, trials):
    most = 40
    log = begun(tmp_path)
    real, seen = log.move, []

    def looked(*given, **named):
        row = real(*given, **named)
        same(read_log(tmp_path, "s01").tail(1), trials.iloc[[len(seen)]], but=[*TIMES, *_ANNOTATED])
        seen.append(row)
        return row

    log.move = looked
    assert play(log, trials, most=most) == len(seen) == most
    log.close()


_ANNOTATED = ["condition_before", "turn"]  # of the last move, which no other follows yet


def test_keys_remarks_pauses_and_faults_are_kept_with_both_times(tmp_path):
    clock = Clock()
    before = datetime.now().astimezone()
    with begun(tmp_path, clock=clock) as log:
        clock.t += 10
        log.key("N", clock.t - 0.5, accepted=True)
        log.key("W", clock.t, accepted=False, why="robot's turn")
        log.key("other", clock.t, accepted=False, why="no arrow")
        log.note("coughed — twice")
        log.event("pause", cause="lost arm", marked=float("nan"))
        assert (log.counters.keys, log.counters.ignored) == (1, {"robot's turn": 1, "no arrow": 1})
    first, *rest = lines_of(tmp_path)
    assert [one["kind"] for one in rest] == ["key", "key", "key", "note", "pause", "end"]
    assert [one["s"] for one in rest[:3]] == [9.5, 10.0, 10.0]
    assert rest[3]["text"] == "coughed — twice"
    assert rest[4]["marked"] is None
    assert first["options"] == {**OPTIONS, "simulated": True}
    for one in (first, *rest):
        assert abs(datetime.fromisoformat(one["at"]) - before) < timedelta(minutes=1)
    assert (datetime.fromisoformat(rest[1]["at"]) - datetime.fromisoformat(rest[0]["at"])).total_seconds() > 0.4


def test_the_log_names_neither_the_machine_nor_who_uses_it_nor_a_place_in_it(tmp_path, trials):
    with begun(tmp_path) as log:
        play(log, trials, most=5)
    text = "".join(path.read_text() for path in (tmp_path / "s01").iterdir() if path.suffix in (".csv", ".jsonl"))
    for word in (os.uname().nodename, str(tmp_path), str(Path.home())):
        assert word not in text


def test_a_subject_whose_session_exists_is_refused_and_keeps_it(tmp_path, trials):
    with begun(tmp_path) as log:
        play(log, trials, most=5)
    before = {path.name: path.read_bytes() for path in (tmp_path / "s01").iterdir()}
    with pytest.raises(ConfigError, match=r"s01 has a session already: .*experiment\.jsonl, subject01\.csv") as error:
        begun(tmp_path)
    assert "--resume" in error.value.cure
    assert {path.name: path.read_bytes() for path in (tmp_path / "s01").iterdir()} == before
    (tmp_path / "s02").mkdir()
    (tmp_path / "s02" / "subject02.csv").write_text("somebody's")
    with pytest.raises(ConfigError, match=r"holds subject02\.csv; nothing is overwritten"):
        begun(tmp_path, "s02")
    assert (tmp_path / "s02" / "subject02.csv").read_text() == "somebody's"


def test_a_recording_of_the_subject_does_not_stand_in_the_way(tmp_path):
    (tmp_path / "s01" / "2026-01-01T000000").mkdir(parents=True)
    begun(tmp_path).close()
    assert (tmp_path / "s01" / "experiment.jsonl").read_text().startswith('{"kind":"session"')


@pytest.mark.parametrize("resume", [False, True])
def test_two_experiments_of_a_subject_cannot_run_at_once(tmp_path, resume):
    with begun(tmp_path):
        with pytest.raises(HardwareError, match="another experiment of s01 is running"):
            begun(tmp_path, resume=resume)
        begun(tmp_path, "s02").close()
    begun(tmp_path, resume=True).close()


@pytest.mark.parametrize("most", [0, 1, 13, 60, 75])
def test_a_session_goes_on_at_the_block_after_and_has_each_block_once(tmp_path, trials, most):
    clock = Clock()
    log = begun(tmp_path, clock=clock)
    play(log, trials, clock=clock, most=most)
    log.close(why="Esc")
    clock.t = 50.0  # the machine was started anew
    with begun(tmp_path, clock=clock, resume=True) as log:
        assert log.counters.moves == most
        assert len(log.progress.broken) <= 1
        play(log, trials, clock=clock)
        log.close(complete=True)
    table = pair_follows_from_the_rows(tmp_path)
    blocks = table.groupby(["practice", "block"], sort=False).ngroup()
    assert blocks.nunique() == len(list(protocol(SHORT)))
    assert blocks.is_monotonic_increasing
    # What was played is what was simulated, and no pair goes across the break.
    played = trials.merge(table[["practice", "block", "episode", "trial"]], how="inner")
    same(table, played, but=[*TIMES, *_ANNOTATED])
    onsets = read_table(tmp_path / "s01" / "trials.parquet")["onset_s"]
    assert onsets.is_monotonic_increasing
    broken = experiments.notes_of(tmp_path / "s01" / "subject01.csv")
    left = trials.groupby(["practice", "block", "episode"], sort=False).cumcount(ascending=False)
    assert len(broken) == (most > 0 and left.iloc[most - 1] > 0)
    with pytest.raises(ConfigError, match="is complete"):
        begun(tmp_path, resume=True)


def test_no_pair_crosses_the_break(tmp_path, trials):
    log = begun(tmp_path)
    play(log, trials, most=75)
    log.close()
    with begun(tmp_path, resume=True) as log:
        play(log, trials)
    table = read_log(tmp_path, "s01")
    cut = table.groupby(["practice", "block", "episode"], sort=False).tail(1)
    assert cut["condition_before"].isna().all()
    assert not cut["turn"].any()
    assert table[table["trial"] == 0]["condition_after"].isna().all()


def test_a_session_does_not_go_on_with_other_options_which_are_named(tmp_path):
    begun(tmp_path).close()
    other = {"seed": 8, "session": {"blocks": 4, "error_rate": 0.2}}
    with pytest.raises(ConfigError, match=r"seed is 8, and was 7; session.error_rate is 0.2, and was 0.3") as error:
        begun(tmp_path, resume=True, options=other)
    assert "session.blocks" not in str(error.value)
    with pytest.raises(ConfigError, match="simulated is False, and was True"):
        begun(tmp_path, resume=True, simulated=False)
    with pytest.raises(DataError, match="no experiment to go on with"):
        begun(tmp_path, "s02", resume=True)


def test_the_sessions_clock_never_runs_backwards(tmp_path):
    clock = Clock()
    with begun(tmp_path, clock=clock) as log:
        clock.t += 500
        log.note("late")
    with begun(tmp_path, clock=Clock(3.0), resume=True) as log:
        log.note("later")
    assert [one["s"] for one in lines_of(tmp_path, "note")] == [500.0, 500.0]
    # A night later, by the time of day.
    path = tmp_path / "s01" / experiments.FILE
    yesterday = datetime.fromisoformat(lines_of(tmp_path)[0]["at"]) - timedelta(days=1)
    first, _, rest = path.read_text().partition("\n")
    path.write_text(json.dumps(json.loads(first) | {"at": yesterday.isoformat()}) + "\n" + rest)
    with begun(tmp_path, resume=True) as log:
        log.note("a day later")
    assert lines_of(tmp_path, "note")[-1]["s"] == pytest.approx(86400, abs=60)


@pytest.mark.parametrize("most", [12, 30])
def test_a_torn_last_line_of_the_pair_is_read_over_and_moved_aside(tmp_path, trials, most):
    log = begun(tmp_path)
    play(log, trials, most=most)
    log.close()
    path = tmp_path / "s01" / "subject01.csv"
    path.write_bytes(path.read_bytes() + b"Shared_Workspace,BLO")
    assert len(read_log(tmp_path, "s01")) == most
    with begun(tmp_path, resume=True) as log:
        assert log.counters.moves == most
        assert any("subject01.csv was torn: 20 bytes" in note for note in log.progress.notes)
        play(log, trials)
    assert b"Shared_Workspace,BLO\n" in (tmp_path / "s01" / TORN).read_bytes()
    pair_follows_from_the_rows(tmp_path)
    assert lines_of(tmp_path, experiments.SESSION)[-1]["mended"]


@pytest.mark.parametrize("cut", [1, 20])
def test_a_torn_last_line_of_what_happened_costs_one_move_which_is_moved_aside(tmp_path, trials, cut):
    log = begun(tmp_path)
    play(log, trials, most=30)
    log.close()
    path, pair = tmp_path / "s01" / experiments.FILE, tmp_path / "s01" / "subject01.csv"
    path.write_bytes(b"".join(path.read_bytes().splitlines(keepends=True)[:-1])[:-cut])
    torn = path.read_bytes().splitlines()[-1]
    more = pair.read_bytes().splitlines()[-1]
    assert len(read_log(tmp_path, "s01")) == 30
    with begun(tmp_path, resume=True) as log:
        assert log.counters.moves == 29
        assert len(log.progress.notes) == 2
        play(log, trials)
    kept = (tmp_path / "s01" / TORN).read_bytes()
    assert torn in kept
    assert more in kept
    pair_follows_from_the_rows(tmp_path)


def test_moves_that_the_pair_lacks_come_from_what_happened(tmp_path, trials):
    log = begun(tmp_path)
    play(log, trials, most=30)
    log.close()
    path = tmp_path / "s01" / "subject01.csv"
    whole = path.read_bytes()
    path.write_bytes(whole[:-100])
    (tmp_path / "s01" / "metadata01.csv").write_bytes(b"")  # as a file system without a journal may leave it
    with begun(tmp_path, resume=True) as log:
        assert any("were added" in note for note in log.progress.notes)
    assert path.read_bytes() == whole
    path.unlink()
    with begun(tmp_path, resume=True) as log:
        assert any("written anew" in note for note in log.progress.notes)
    assert path.read_bytes() == whole


@pytest.mark.parametrize("name", ["subject01.csv", "metadata01.csv"])
def test_an_edited_log_is_not_gone_on_with(tmp_path, trials, name):
    log = begun(tmp_path)
    play(log, trials, most=60)
    log.close()
    path = tmp_path / "s01" / name
    lines = path.read_text().splitlines(keepends=True)
    lines[1] = lines[1].replace("Test 1", "Test 2")
    path.write_text("".join(lines))
    with pytest.raises(DataError, match=rf"{name}, line 2 is not what experiment\.jsonl tells"):
        begun(tmp_path, resume=True)
    assert path.read_text() == "".join(lines)


def test_a_damaged_line_in_the_middle_is_named(tmp_path, trials):
    log = begun(tmp_path)
    play(log, trials, most=20)
    log.close()
    path = tmp_path / "s01" / experiments.FILE
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join([*lines[:7], lines[7][:10] + b"\n", *lines[8:]]))
    for look in (lambda: read_log(tmp_path, "s01"), lambda: begun(tmp_path, resume=True)):
        with pytest.raises(DataError, match="line 8 is damaged"):
            look()
    path.write_text('{"kind":"move"}\n')
    with pytest.raises(DataError, match="is not what an experiment writes"):
        read_log(tmp_path, "s01")
    path.write_bytes(b"".join(lines).replace(b'"trial":3', b'"tria":3'))
    with pytest.raises(DataError, match=r"\(move\) cannot be understood: KeyError"):
        begun(tmp_path, resume=True)


def test_a_log_that_somebody_cut_is_refused_also_where_an_experiment_wrote_it(tmp_path, trials):
    log = begun(tmp_path)
    play(log, trials)
    log.close(complete=True)
    path = tmp_path / "s01" / "subject01.csv"
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join(lines[:-2]))
    with pytest.raises(DataError, match="truncated") as error:
        read_log(tmp_path, "s01")
    assert "--resume" in error.value.cure


def test_an_episode_whose_last_move_came_only_to_what_happened_is_one_that_was_broken_off(tmp_path, trials):
    """As a kill between two files leaves it."""
    home = tmp_path / "s01"
    log = begun(tmp_path)
    play(log, trials)
    whole = {name: (home / name).read_bytes() for name in ("subject01.csv", "metadata01.csv")}
    log.close()
    with begun(tmp_path / "less") as log:
        play(log, trials, most=len(trials) - 1)
    for name in whole:
        (home / name).write_bytes((tmp_path / "less" / "s01" / name).read_bytes())
    assert len(read_log(tmp_path, "s01")) == len(trials) - 1
    config = acquire.Config(source="dataset", path=str(tmp_path))
    rules = behaviour.study_rules({"s01": config}).set_index("rule")
    assert rules["measured"]["episodes that do not end on the goal tile"] == 0
    with begun(tmp_path, resume=True):
        pass
    assert {name: (home / name).read_bytes() for name in whole} == whole


def test_a_broken_off_episode_needs_what_the_experiment_kept(tmp_path, trials):
    log = begun(tmp_path)
    play(log, trials, most=30)
    log.close()
    assert len(read_log(tmp_path, "s01")) == 30
    (tmp_path / "s01" / experiments.FILE).unlink()
    with pytest.raises(DataError, match="not on its goal"):
        read_log(tmp_path, "s01")


def full_after(room):
    """Return what writes so many bytes, and then has no room."""
    real = os.write

    def write(file, data):
        nonlocal room
        part = data[:room]
        room -= len(part)
        if not part:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return real(file, part)

    return write


def test_a_full_disk_is_told_and_what_was_not_written_comes_later(tmp_path, trials, monkeypatch):
    log = begun(tmp_path)
    play(log, trials, most=20)
    row = trials.iloc[20]
    with monkeypatch.context() as patch:
        patch.setattr(disk.os, "write", full_after(130))
        with pytest.raises(StageError, match="No space left on device") as error:
            log.move(move_of(row), onset=2000.0, t_f=0.8, ended=2001.0)
        assert "free space" in error.value.cure
        with pytest.raises(StageError, match="No space left"):
            log.note("still full")
    # All that had been written can be read, at any time.
    assert len(read_log(tmp_path, "s01")) == 20
    assert len(lines_of(tmp_path, experiments.MOVE)) == 20
    log.note("free again")
    log.close()
    same(pair_follows_from_the_rows(tmp_path), trials.head(21), but=[*TIMES, *_ANNOTATED])
    assert [one["text"] for one in lines_of(tmp_path, "note")] == ["still full", "free again"]


def test_what_has_no_room_at_the_end_is_told_whole(tmp_path, trials, monkeypatch):
    """Put where the words say, the log goes on as if there had been room."""
    log, path = begun(tmp_path), tmp_path / "s01" / experiments.FILE
    play(log, trials, most=20)
    row = trials.iloc[20]
    with monkeypatch.context() as patch:
        patch.setattr(disk.os, "write", full_after(130))
        with pytest.raises(StageError, match="No space left on device"):
            log.move(move_of(row), onset=2000.0, t_f=0.8, ended=2001.0)
        with pytest.raises(StageError, match="No space left on device"):
            log.catch_up()
        with pytest.raises(StageError, match="No space left on device") as error:
            log.close()
    assert "in the place of the last line" in error.value.cure
    words, *missing = f"{error.value.problem}\n".splitlines(keepends=True)
    assert f"missing at the end of {path}" in words
    assert [json.loads(line)["kind"] for line in missing] == [experiments.MOVE, experiments.END]
    whole, _, torn = path.read_bytes().rpartition(b"\n")
    assert torn
    assert missing[0].startswith(torn.decode())
    path.write_bytes(whole + b"\n" + "".join(missing).encode())
    begun(tmp_path, resume=True).close()
    same(pair_follows_from_the_rows(tmp_path), trials.head(21), but=[*TIMES, *_ANNOTATED])


def test_a_disk_that_has_room_for_rows_and_none_for_new_files_leaves_a_log_that_can_be_read(
    tmp_path, trials, monkeypatch
):
    """Several moves and the next episode may come to the one file and not to the other."""
    log = begun(tmp_path)
    real, full = disk.replaced, []

    def none(path, write, *, sync=True):
        if full:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        real(path, write, sync=sync)

    monkeypatch.setattr("hrcneuro.experiment.log.replaced", none)
    paths = retrace({"s": trials}).episodes["path"]
    play(log, trials, most=3)
    full.append(True)
    written = 3
    for row in trials.iloc[3:40].itertuples():
        if row.trial == 0:
            break
        with pytest.raises(StageError, match="No space left"):
            log.move(move_of(row), onset=2000.0 + row.Index, t_f=0.8, ended=2001.0 + row.Index)
        written += 1
        assert len(read_log(tmp_path, "s01")) == written
    with pytest.raises(StageError):
        log.block(Block(True, 2, "sC", 1), Areas(frozenset()))
    with pytest.raises(StageError):
        log.episode(1, paths[1])
    with pytest.raises(StageError):
        log.move(move_of(trials.iloc[written]), onset=3000.0, t_f=0.8, ended=3001.0)
    same(read_log(tmp_path, "s01"), trials.head(written + 1), but=[*TIMES, *_ANNOTATED])
    full.clear()
    log.close()
    assert len(pair_follows_from_the_rows(tmp_path)) == written + 1


def test_a_place_that_cannot_be_written_is_refused(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    with pytest.raises(ConfigError, match="cannot be written"):
        begun(tmp_path / "file")
    monkeypatch.setattr("shutil.disk_usage", lambda _: type("Usage", (), {"free": 1000})())
    with pytest.raises(StageError, match="are free; nothing was begun"):
        begun(tmp_path / "recordings")
    assert not (tmp_path / "recordings").exists()


def test_in_real_time_a_thread_brings_the_table_and_tells_of_its_faults(tmp_path, trials, monkeypatch):
    log = begun(tmp_path, real_time=True)
    play(log, trials, most=30, flush=False)
    log.flush_table()
    deadline = time.monotonic() + 10
    while not (tmp_path / "s01" / "trials.parquet").exists():
        assert time.monotonic() < deadline
        time.sleep(0.01)
    assert len(read_table(tmp_path / "s01" / "trials.parquet")) == 30

    def broken(file):
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    with monkeypatch.context() as patch:
        patch.setattr(disk.os, "fsync", broken)
        log.note("one")
        with pytest.raises(StageError, match="Input/output error"):
            while time.monotonic() < deadline:
                log.note("more")
                time.sleep(0.01)
    with contextlib.suppress(StageError):  # of the last wait before the disk was whole again
        log.close()
    assert len(read_log(tmp_path, "s01")) == 30


def test_an_empty_session_can_be_gone_on_with_and_has_no_table(tmp_path):
    begun(tmp_path).close()
    assert not (tmp_path / "s01" / "trials.parquet").exists()
    assert (tmp_path / "s01" / "subject01.csv").read_text() == authors_log.log_head()
    with begun(tmp_path, resume=True) as log:
        log.block(Block(False, 1, "iC", 2), Directions(frozenset("NE")))
    assert not log.progress.rows


def test_moves_need_a_block_and_an_episode(tmp_path, trials):
    move = move_of(trials.iloc[0])
    with begun(tmp_path) as log:
        with pytest.raises(ValueError, match="none was begun"):
            log.move(move, onset=0.0, t_f=1.0, ended=1.0)
        log.block(Block(False, 1, "iC", 2), Directions(frozenset("NE")))
        with pytest.raises(ValueError, match="none was begun"):
            log.move(move, onset=0.0, t_f=1.0, ended=1.0)
    assert isinstance(log, Log)


def test_killed_at_any_instant_it_loses_at_most_the_running_move_and_goes_on(tmp_path, trials):
    sizes = np.random.default_rng(int(time.time())).integers(0, 40_000, 10).tolist()
    helpers = Path(killed_writers.__file__).parent
    words = [sys.executable, killed_writers.__file__, str(tmp_path), *map(str, sizes)]
    paths = os.pathsep.join([str(helpers), str(helpers.parents[1])])
    subprocess.run(words, check=True, env=os.environ | {"PYTHONPATH": paths}, timeout=120)
    for number in range(len(sizes)):
        folder = tmp_path / str(number)
        told = lines_of(folder, experiments.MOVE)
        if told:
            moves = read_log(folder, "s01")
            assert len(told) - 1 <= len(moves) <= len(told), sizes
            same(moves, trials.head(len(moves)), but=[*TIMES, *_ANNOTATED])
        if (folder / "s01" / "trials.parquet").exists():
            read_table(folder / "s01" / "trials.parquet")
        with begun(folder, resume=True) as log:
            assert log.counters.moves == len(told)
            play(log, trials)
            log.close(complete=True)
        again = pair_follows_from_the_rows(folder)
        assert again.groupby(["practice", "block"]).ngroups == len(list(protocol(SHORT)))
