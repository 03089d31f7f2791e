"""A recorded session and its log: what an amplifier sent comes back, on its samples, whatever its clock does."""

import json

import numpy as np
import pandas as pd
import pytest
from experiment_log import begun, play, simulated
from foreign import save_log_files
from recorded_lab import SFREQ, Lab, marker_of

from hrcneuro.contract import Inputs
from hrcneuro.errors import ConfigError, DataError
from hrcneuro.io.fif import read_raw
from hrcneuro.io.tables import read_table
from hrcneuro.live import part, xdf
from hrcneuro.sources import experiments, joining, sessions
from hrcneuro.sources.chain import read_chain
from hrcneuro.stages import acquire

pytest.importorskip("pyxdf", reason="pyxdf is not installed: pip install 'hrcneuro[xdf]'")


@pytest.fixture(scope="module")
def trials(moves):
    """A few moves, whose onsets lie on samples."""
    table = moves(5)
    return table.assign(onset_s=np.round((table["onset_s"] + 3) * SFREQ) / SFREQ)


@pytest.fixture
def lab(tmp_path, trials):
    def make(**options):
        folder = tmp_path / "recordings" / "s01" / "one"
        made = Lab(folder, trials, **options)
        save_log_files(folder, "s01", trials)
        return made

    return make


def acquired(lab, tmp_path, **options):
    config = acquire.Config(source="recording", path=str(lab.folder), drop=(), **options)
    out = tmp_path / "out"
    out.mkdir()
    summary = acquire.run(config, Inputs("s01", {}), out)
    raw = read_raw(out / "s01_raw.fif", preload=True)
    return raw, read_table(out / "trials.parquet"), read_table(out / "onsets.parquet"), summary


def sent_as(raw):
    """Return the samples of the recording, as numbers of the sent ones."""
    return np.rint(raw.get_data("Fz")[0] * 1e6).astype(int)


@pytest.mark.parametrize(
    ("offset", "drift_ppm", "what"),
    [(0.0, 0.0, ()), (0.02, 50.0, ()), (-3600.0, -50.0, ()), (0.0, 0.0, ("drift=50",)), (0.0, 0.0, ("delay=0.037",))],
)
def test_what_was_sent_comes_back_and_each_move_lies_on_its_sample(lab, tmp_path, trials, offset, drift_ppm, what):
    """Also where the amplifier's clock is another's, drifts, or stamps late: the trigger's edge tells."""
    one = lab(offset=offset, drift_ppm=drift_ppm, what=what).go_on().end()
    raw, table, onsets, summary = acquired(one, tmp_path)
    first = sent_as(raw)[0]
    np.testing.assert_array_equal(sent_as(raw), (first + np.arange(raw.n_times)) % 1000)
    begun = table["onset_sample"].notna()
    assert begun.sum() > 0.8 * len(trials)
    rate = one.amplifier._rate
    wanted = np.round(trials["onset_s"].to_numpy()[begun] * rate) - first
    assert np.abs(table["onset_sample"].to_numpy(float)[begun] - wanted).max() <= 1
    difference = onsets["difference_ms"].dropna()
    assert difference.median() == pytest.approx(37 if "delay=0.037" in what else 0, abs=4)
    assert "onsets are the trigger channel's edges" in " ".join(summary["notes"])


class Triggered:
    """An experiment by trigger port alone: a motion each that began, whatever became of it."""

    def __init__(self, folder, seed=1):
        self.folder, self.trials = folder / "recordings" / "s01", simulated(seed)
        self.onsets = []  # of the triggers, s

    def log(self):
        """Write a log that was broken off in a block, and before that in the first move of one, and gone on with.

        Return it, with the onsets of its rows where they moved.
        """
        first = self.trials[~self.trials["practice"]]
        n_practice = len(self.trials) - len(first)
        moved = self.trials["executed"].notna()
        keys = self.trials[KEYS].apply(tuple, axis=1)
        # Killed in the first move of the first main block, which is begun again; then in the midst of that block.
        resumed = {"resume": True}
        for most, given in ((n_practice, {}), (20, resumed), (None, resumed)):
            log = begun(self.folder.parent, "s01", **given)
            play(log, self.trials, most=most, cut=True)
            if most is None:
                log.close(complete=True)
            else:
                log.close()
        kept = experiments.beside(self.folder / "subject01.csv").onsets
        rows = pd.read_parquet(self.folder / "trials.parquet")
        when = dict(zip(keys, self.trials["onset_s"] + 3.0, strict=True))
        seen = set()
        for key in kept:
            # What is begun again has begun a while before.
            again = kept.count(key) > 1 and key not in seen
            self.onsets.append(when[key] - (0.5 if again else 0.0))
            seen.add(key)
        assert moved.sum() < len(self.trials)
        return rows, np.array([when[tuple(key)] for key in rows[KEYS].itertuples(index=False)])


KEYS = ["practice", "block", "episode", "trial"]


def test_an_experiment_by_trigger_port_alone_is_joined_by_the_motions_that_began(tmp_path):
    """Nothing moves where the grid's edge stops a move; a motion that never ended has a trigger, too."""
    one = Triggered(tmp_path)
    rows, wanted = one.log()
    edges = pd.DataFrame({"onset_s": np.sort(one.onsets)})
    lab = Lab(one.folder / "recording", edges, marks=False).go_on().end()
    raw, table, onsets, summary = acquired(lab, tmp_path, amp_delay_ms=37.0)
    moved = rows["executed"].notna().to_numpy()
    assert (~moved).sum() > 0
    assert len(one.onsets) == moved.sum() + 2
    assert table["onset_sample"].notna().to_numpy().tolist() == moved.tolist()
    sample = table["onset_sample"].to_numpy(float)[moved]
    assert np.abs(sample - (np.round(wanted[moved] * SFREQ) - sent_as(raw)[0])).max() <= 1
    assert onsets["marker_s"].isna().all()
    assert onsets["trigger_s"].notna().to_numpy().tolist() == moved.tolist()
    notes = " ".join(summary["notes"])
    assert "2 of the motions that began did not come to their end" in notes
    assert "moves that the grid's edge stopped have no markers" in notes


def test_an_older_experiments_log_tells_by_its_moves_what_has_begun(tmp_path):
    trials = simulated(2)
    with begun(tmp_path, "s01") as log:
        play(log, trials, most=30)
    journal = tmp_path / "s01" / experiments.FILE
    lines = [json.loads(line) for line in journal.read_text().splitlines()]
    lines = [line for line in lines if line["kind"] != "onset"]
    moved = [line for line in lines if line["kind"] == "move" and line["executed"]]
    moved[3]["again"] = True
    journal.write_text("".join(f"{json.dumps(line)}\n" for line in lines))
    expected = [tuple(line[key] for key in KEYS) for line in moved]
    expected.insert(3, expected[3])
    assert experiments.onsets_of(tmp_path / "s01" / "subject01.csv") == tuple(expected)


def test_without_a_trigger_the_markers_count_by_the_clocks_and_the_delay_that_is_configured(lab, tmp_path, trials):
    one = lab(offset=5.0, drift_ppm=30.0, what=("delay=0.037",)).go_on().end()
    raw, table, onsets, _ = acquired(one, tmp_path, markers="annotations", amp_delay_ms=37.0)
    begun = table["onset_sample"].notna()
    wanted = np.round(trials["onset_s"].to_numpy()[begun] * SFREQ) - sent_as(raw)[0]
    assert np.abs(table["onset_sample"].to_numpy(float)[begun] - wanted).max() <= 1
    assert onsets["trigger_s"].isna().all()


@pytest.mark.parametrize("lost_s", [0.12, 0.6])
def test_a_gap_becomes_a_boundary_and_what_follows_lies_where_it_did(lab, tmp_path, trials, lost_s):
    one = lab(what=(f"drop={lost_s}@8",)).go_on().end()
    raw, table, _, summary = acquired(one, tmp_path)
    numbers = sent_as(raw)
    (jump,) = np.flatnonzero(np.diff(numbers) % 1000 != 1)
    assert summary["breaks"] == 1
    (boundary,) = {a["onset"] for a in raw.annotations if a["description"] != "move"}
    assert boundary * SFREQ == pytest.approx(jump + 1, abs=1)
    lost = int((numbers[jump + 1] - numbers[jump] - 1) % 1000)
    begun = table["onset_sample"].notna().to_numpy()
    sample = table["onset_sample"].to_numpy(float)
    wanted = np.round(trials["onset_s"].to_numpy() * SFREQ) - numbers[0]
    after = begun & (wanted > jump + lost + 1)
    np.testing.assert_allclose(sample[after], wanted[after] - lost, atol=1)


def test_parts_are_joined_by_the_time_of_day_also_where_the_clock_began_anew(lab, tmp_path, trials):
    one = lab().go_on(12.0)
    one.end()
    sent = one.amplifier.sent
    one.begin(2)
    one.go_on().end()
    # By their names the other way round.
    first, second = one.folder / "part1.xdf", one.folder / "part2.xdf"
    first.rename(one.folder / "z.xdf")
    second.rename(one.folder / "a.xdf")
    raw, table, _, summary = acquired(one, tmp_path)
    assert summary["breaks"] == 1
    numbers = sent_as(raw)
    (jump,) = np.flatnonzero(np.diff(numbers) % 1000 != 1)
    assert (numbers[0] + jump) % 1000 == pytest.approx(sent % 1000, abs=60)
    assert table["onset_sample"].notna().sum() > 0.8 * len(trials)


def stumps(one):
    """Yield beginnings of a recording as a recorder leaves them that is killed in its first instant."""
    whole = (one.folder / "part1.xdf").read_bytes()
    head = len(xdf.MAGIC + xdf.file_header("2026-01-01T00:01:00"))
    first = next(
        at for at in range(len(whole)) if whole[at:].startswith(b"<?xml") and b"<type>EEG" in whole[at : at + 200]
    )
    yield from (b"", whole[:head], whole[: whole.index(b"</info>", first) + len(b"</info>")])


@pytest.mark.parametrize("stream", ["", "actiCHamp"])
def test_a_part_without_a_sample_is_left_out_and_said(lab, tmp_path, trials, stream):
    one = lab().go_on().end()
    alone = acquired(one, tmp_path, stream=stream)
    pieces = [*stumps(one)]
    for number, content in enumerate(pieces, start=2):
        part.path_of(one.folder, number).write_bytes(content)
    (tmp_path / "out").rename(tmp_path / "alone")
    raw, table, _, summary = acquired(one, tmp_path, stream=stream)
    np.testing.assert_array_equal(sent_as(raw), sent_as(alone[0]))
    pd.testing.assert_frame_equal(table, alone[1])
    told = [text for text in summary["warnings"] if text.startswith("left out, without EEG: part")]
    assert [f"part{number}.xdf" in text for number, text in enumerate(told, start=2)] == [True] * len(pieces)
    parts = sessions.in_order([part.path_of(one.folder, number) for number in range(1, 5)])
    chain = read_chain(parts, acquire.Config(stream=stream), window_s=0.3, delay_s=0.0)
    assert len(chain.moves) == len(trials)
    assert sum("left out, without EEG" in note for note in chain.notes) == len(pieces)


@pytest.mark.parametrize("stream", ["", "actiCHamp"])
def test_a_recording_of_which_no_part_has_a_sample_is_refused(lab, stream):
    one = lab().go_on(3.0).end()
    for number, content in enumerate(stumps(one), start=2):
        path = part.path_of(one.folder, number)
        path.write_bytes(content)
        with pytest.raises(DataError, match=path.name):
            joining.read_joined([path], stream=stream)
        with pytest.raises(DataError, match=path.name):
            read_chain([path], acquire.Config(stream=stream), window_s=0.3, delay_s=0.0)


def test_the_mark_of_a_simulation_stays(lab, tmp_path):
    one = lab().go_on().end()
    assert acquired(one, tmp_path)[3]["origin"]["eeg"] == "of unknown origin"


def test_markers_of_another_subject_are_refused(lab, tmp_path):
    one = lab().go_on(15.0).end()
    log, metadata = (one.folder / f"{name}01.csv" for name in ("subject", "metadata"))
    config = acquire.Config(source="recording", path=str(one.folder))
    log.rename(one.folder / "subject02.csv")
    metadata.rename(one.folder / "metadata02.csv")
    with pytest.raises(DataError, match="the markers are of s01, and the log is of s02"):
        acquire.run(config, Inputs("s02", {}), tmp_path)


@pytest.mark.parametrize("absent", ["log", "part", "folder"])
def test_what_is_missing_is_named(lab, tmp_path, absent):
    one = lab().go_on(5.0).end()
    path = one.folder
    if absent == "log":
        (path / "subject01.csv").unlink()
    elif absent == "part":
        (path / "part1.xdf").unlink()
    else:
        path = tmp_path / "nowhere"
    said = {"log": r"subjectNN\.csv", "part": "no recording", "folder": "does not exist"}
    with pytest.raises(DataError, match=said[absent]):
        acquire.sources(acquire.Config(source="recording", path=str(path)), "s01")


def test_an_experiments_log_lies_one_folder_above_its_recordings(lab, tmp_path):
    one = lab().go_on(15.0).end()
    for name in ("subject01.csv", "metadata01.csv"):
        (one.folder / name).rename(one.folder.parent / name)
    (one.folder.parent / "subject02.csv").write_text("another subject's")
    kept = one.folder.parent / experiments.FILE
    kept.write_text("")
    pattern = acquire.Config(source="recording", path=str(tmp_path / "recordings" / "{subject}" / "*"))
    for config in (pattern, acquire.Config(source="recording", path=str(one.folder))):
        files = acquire.sources(config, "s01")
        assert files["log"] == one.folder.parent / "subject01.csv"
        assert files["metadata"] == one.folder.parent / "metadata01.csv"
        assert files["kept"] == kept
    assert (acquired(one, tmp_path)[1]["onset_sample"].notna()).any()


def test_a_session_with_two_logs_is_refused_also_where_one_lies_above(lab, tmp_path):
    one = lab().go_on(5.0).end()
    (one.folder.parent / "subject01.csv").write_bytes((one.folder / "subject01.csv").read_bytes())
    with pytest.raises(DataError, match=r"a session has one subjectNN\.csv") as error:
        acquire.sources(acquire.Config(source="recording", path=str(one.folder)), "s01")
    assert str(one.folder / "subject01.csv") in str(error.value)
    assert str(one.folder.parent / "subject01.csv") in str(error.value)


def test_a_log_that_an_experiment_broke_off_is_noted(lab, tmp_path, trials):
    one = lab().go_on(15.0).end()
    last = trials.iloc[-1]
    named = {name: int(last[name]) for name in ("block", "episode")} | {"practice": bool(last["practice"])}
    kept = one.folder / experiments.FILE
    kept.write_text(json.dumps({"kind": "move", "s": 1.0, "last": False, **named}) + "\n")
    notes = acquired(one, tmp_path)[3]["notes"]
    assert f"BLOCK {last['block']}, episode {last['episode']} was broken off after 1 move" in notes


def test_an_inspection_shows_both_sides_in_a_few_lines(lab):
    one = lab().go_on(20.0).end()
    view = acquire.inspect(acquire.Config(source="recording", path=str(one.folder)), "s01")
    assert [marker["event"] for marker in view["recording"]["markers"]] == ["move/…"]
    assert view["log"]["rows"] == len(one.trials)
    assert any("edges" in note for note in view["recording"]["notes"])


def test_edges_far_from_markers_time_nothing():
    marker = np.array([1.0, 2.0, np.nan, 4.0])
    onsets = sessions.snapped(marker, np.array([1.05, 2.3, 4.0]), window_s=0.1, delay_s=0.02)
    np.testing.assert_allclose(onsets.trigger_s, [1.05, np.nan, np.nan, 4.0])
    np.testing.assert_allclose(onsets.onset_s, [1.05, 2.02, np.nan, 4.0])


@pytest.mark.parametrize("late", [0.095, 0.1, 0.13, -0.1])
@pytest.mark.parametrize("configured", [0.0, 0.05])
def test_edges_about_as_late_as_the_window_is_wide_time_all_moves_or_none(late, configured):
    rng = np.random.default_rng(2)
    marker = 10 + np.cumsum(rng.uniform(0.7, 1.5, 200))
    edges = marker + late + 0.004 * rng.standard_normal(200)
    edges[50] = np.nan
    onsets = sessions.snapped(marker, np.sort(edges[np.isfinite(edges)]), window_s=0.1, delay_s=configured)
    timed = np.isfinite(onsets.trigger_s)
    assert timed.sum() == 199
    # The one without an edge is timed as its neighbours are.
    assert onsets.onset_s[50] == pytest.approx(marker[50] + late, abs=0.002)


def test_edges_that_have_nothing_to_do_with_the_markers_give_no_delay():
    rng = np.random.default_rng(2)
    marker = 10 + np.cumsum(rng.uniform(0.7, 1.5, 200))
    edges = np.sort(rng.uniform(10, marker[-1], 150))
    onsets = sessions.snapped(marker, edges, window_s=0.02, delay_s=0.05)
    alone = np.isnan(onsets.trigger_s)
    np.testing.assert_allclose(onsets.onset_s[alone], marker[alone] + 0.05)


def test_no_path_is_a_mistake_of_the_configuration():
    with pytest.raises(ConfigError, match=r"acquire\.path is empty"):
        acquire.sources(acquire.Config(source="recording"), "s01")


def test_a_log_of_another_session_is_told(trials):
    log = trials.assign(block=trials["block"] + 20)
    table = pd.DataFrame({"onset_s": trials["onset_s"], "event": [marker_of(row) for _, row in trials.iterrows()]})
    with pytest.raises(DataError, match="names a row of the log"):
        sessions.by_name(table, log, "s01")
    assert json.dumps(sessions.by_name(table, trials, "s01")[1:]) == "[0, 0]"
