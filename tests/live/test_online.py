"""The closed loop at virtual pace: what it decides, what teaches it, what goes wrong; and the same from a recording."""

import json
from concurrent.futures import Future
from dataclasses import replace

import numpy as np
import pytest
from online_lab import LABELS, SFREQ, Lab, decoder, learner, moves
from virtual_streams import Sender

from hrcneuro.cli.onlining import as_live, compared
from hrcneuro.decoding import offline
from hrcneuro.eeg.causal import State
from hrcneuro.errors import DataError, HardwareError
from hrcneuro.live import decisions, replaying
from hrcneuro.live.online_streams import find_eeg
from hrcneuro.live.parameters import OnlineOptions, check_online
from hrcneuro.live.transport import TRUTH
from hrcneuro.paradigm import markers

pyxdf = pytest.importorskip("pyxdf", reason="pyxdf is not installed: pip install 'hrcneuro[xdf]'")
CHUNKS = (1, 7, 10, 40, 1000)


def spoiled(numbers, what):
    """Return a spoiler: ``what`` is done to the rows of these samples."""

    def spoil(now, stamps, rows):
        hit = np.isin(now, numbers)
        if what == "drop":
            return stamps[~hit], rows[~hit]
        rows = rows.copy()
        rows[hit, 1] = what
        return stamps, rows

    return spoil


def sample(seconds, length=1):
    return int(seconds * SFREQ) + np.arange(length)


def log_of(lab, folder):
    """Write what a lab logged as the command does, and return the file."""
    folder.mkdir(exist_ok=True)
    log = decisions.DecisionLog(folder)
    for line in lab.lines:
        log(line)
    log.close()
    return log.path


def again(recording, options, chunk, known=None):
    """Return the lines of a replay, and its learner."""
    lines, one = [], learner()
    replaying.replay(
        replaying.read(recording, options), decoder(), one, options, subject="s01", chunk=chunk,
        publish=lambda text, stamp: None, log=lines.append, known=known,
    )  # fmt: skip
    return [line for line in lines if line["kind"] == "move"], one


# --- decisions and learning ----------------------------------------------------------------------------------------


def test_each_move_is_decided_in_time_and_teaches_unless_no_plain_step_follows():
    lab = Lab(moves()).run()
    assert len(lab.trials) == 24
    assert lab.causes == {"last": 3}
    for line in lab.trials:
        assert line["deadline_met"]
        assert line["zero_from"] == "trigger"
        assert 0 <= line["zero_shift_ms"] <= 4 + 12  # two samples late by construction, and up to one of rounding
        assert line["problem"] == {"human": "HHvsHR", "robot": "RRvsRH"}[line["actor"]]
        assert (line["predicted"] == line["actor"]) is (line["score"] <= 0)
        assert line["sent_s"] - line["marker_s"] < 0.7
        changed = line["policy_before"] != line["policy_after"]
        assert changed is (line["q_before"] != line["q_after"]) is line["update"]
    assert lab.learner.updates == 21


def test_what_is_published_is_what_is_logged_and_shadow_lets_nothing_be_taken_up():
    for mode in ("closed", "shadow"):
        lab = Lab(moves(episodes=1), options=OnlineOptions(mode=mode)).run()
        told = [json.loads(text) for text in lab.published]
        assert [one["marker"] for one in told[1:]] == [line["marker"] for line in lab.trials]
        for one, line in zip(told[1:], lab.trials, strict=True):
            assert one["policy"] == (line["policy_after"] if mode == "closed" else None)
            assert one["probability"] == line["probability"]
        assert "marker" not in told[0]  # of the block's beginning
        assert lab.learner.updates == 7


def test_semi_changes_the_policy_at_a_blocks_end_only():
    events = moves(episodes=2) + moves(episodes=1, block=2, start_s=24.0, seed=2)
    lab = Lab(events, options=OnlineOptions(mode="semi")).run()
    policies = [json.loads(text)["policy"] for text in lab.published]
    first, second = policies[:17], policies[17:]
    assert all(one == dict.fromkeys("NESW", 0.5) for one in first)
    assert all(one == lab.trials[15]["policy_after"] for one in second)
    assert second[0] != first[0]
    assert lab.trials[-1]["policy_after"] != second[0]


def test_practice_other_scenarios_diagonals_and_old_markers_are_decided_or_not_and_never_teach():
    events = moves(episodes=1, practice=True) + moves(episodes=1, scenario="sC", block=2, start_s=14.0)
    where = {"scenario": "iC", "block": 3, "episode": 1, "practice": False}
    events += [
        (24.0, markers.of_move("s01", trial=0, actor="robot", next="NE", **where)),
        (25.0, markers.of_move("s01", trial=1, **where)),
        (26.0, markers.of_move("s01", trial=2, actor="human", **where)),
    ]
    lab = Lab(events).run()
    assert lab.causes == {"practice": 8, "scenario": 8, "diagonal": 1, "untagged": 2}
    assert lab.learner.updates == 0
    # Without an actor it is not known which decoder is meant; without a next step it is.
    assert [line["score"] is None for line in lab.trials[-3:]] == [False, True, False]


def test_a_block_may_begin_with_no_knowledge():
    events = moves(episodes=1) + moves(episodes=1, block=2, start_s=14.0)
    lab = Lab(events, options=OnlineOptions(mode="closed", afresh=True)).run()
    assert lab.trials[8]["policy_before"] == dict.fromkeys("NESW", 0.5)
    assert lab.trials[7]["policy_before"] != lab.trials[8]["policy_before"]


def test_without_a_trigger_the_marker_times_the_move_through_clocks_that_differ():
    lab = Lab(moves(), trigger=False, offset=37.25, options=OnlineOptions(mode="closed", amp_delay_ms=20.0)).run()
    assert lab.causes == {"last": 3}
    for line in lab.trials:
        assert line["zero_from"] == "marker"
        assert line["zero_shift_ms"] == pytest.approx(20.0, abs=1e-6)
        # On the EEG's clock, and within half a sample.
        assert line["zero_stamp"] + 37.25 == pytest.approx(line["marker_s"] + 0.020, abs=0.5 / SFREQ + 1e-6)


def test_an_edge_outside_the_window_times_nothing():
    lab = Lab(moves(episodes=1), options=OnlineOptions(mode="closed", snap_s=0.004)).run()
    # The edge is two samples late, and up to one more.
    assert {line["zero_from"] for line in lab.trials} == {"marker"}


def test_a_policy_is_taken_from_a_text_only_if_it_is_sound():
    sound = {"N": 0.25, "E": 1, "S": 0, "W": 0.5}
    assert decisions.policy_in(decisions.message("closed", sound, 1.0)) == sound
    assert decisions.policy_in(decisions.message("shadow", None, 1.0)) is None
    for wrong in ({**sound, "N": 1.01}, {**sound, "N": -0.1}, {**sound, "N": float("nan")}, {**sound, "X": 0.5},
                  {"N": 0.5}, {**sound, "N": "1"}, {**sound, "N": True}, [0.5] * 4, 0.5):  # fmt: skip
        assert decisions.policy_in(json.dumps({"policy": wrong})) is None
    for text in ("", "{}", "[]", "null", "no JSON"):
        assert decisions.policy_in(text) is None


# --- what goes wrong -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("what", "cause"), [("drop", "gap"), (np.nan, "not finite"), (np.inf, "not finite"), (30_000.0, "artefact")]
)
def test_a_spoiled_epoch_teaches_nothing_and_the_next_ones_do(what, cause):
    events = moves(episodes=1)
    at = events[3][0]  # the third move
    lab = Lab(events, spoil=spoiled(sample(at + 0.3, 5), what)).run()
    spoilt = lab.trials[2]
    assert (spoilt["cause"], spoilt["update"]) == (cause, False)
    assert spoilt["policy_before"] == spoilt["policy_after"]
    if what == "drop":
        assert lab.loop.events["gap"] == 1
    assert lab.causes[cause] == 1
    assert lab.trials[5]["update"]


def test_a_railed_channel_is_told_from_a_sound_one():
    events = moves(episodes=1)
    lab = Lab(events, spoil=spoiled(sample(events[2][0] + 0.2, 3), 500.0), rail_uv=400.0).run()
    assert lab.causes == {"railed": 1, "last": 1}
    assert Lab(events, spoil=spoiled(sample(events[2][0] + 0.2, 3), 500.0)).run().causes == {"last": 1}


def test_eeg_that_stops_within_a_move_leaves_it_undecided_and_ends_the_loop_when_it_does_not_return():
    events = moves(episodes=1)
    lab = Lab(events, spoil=spoiled(sample(events[4][0] + 0.3, 10**6), "drop"))
    with pytest.raises(HardwareError, match="no EEG for") as caught:
        lab.run(40)
    assert caught.value.exit_code == 4
    assert lab.causes["missing"] == 5  # the fourth move and all later ones
    assert any("no samples for 1.0 s" in text for text in lab.told)
    assert lab.learner.updates == 3
    assert lab.network.now - lab.begun < events[4][0] + 0.3 + OnlineOptions().lost_s + 1.0


def test_eeg_that_comes_back_as_another_run_is_taken_up():
    lab = Lab(moves(episodes=2))
    lab.run(8.0)
    lab.eeg.close()
    old, lab.eeg = lab.eeg, Sender("amp", "EEG", labels=(*LABELS, "TRIGGER"), sfreq=SFREQ, source_id="amp2")
    lab.typed()
    lab.network.outlets.remove(old)
    lab.run(10.0)
    lab.network.outlets.append(lab.eeg)
    lab.run()
    assert "the EEG is back" in lab.told
    assert lab.trials[-2]["update"]
    assert lab.loop.deciding.causes["missing"] >= 1
    assert sum(lab.causes.values()) + lab.learner.updates == 16


def test_while_eeg_that_comes_back_is_connected_to_nobody_waits():
    lab = Lab(moves(episodes=4))
    lab.run(8.0)
    connecting, opens = Future(), lab.network.opening
    lab.network.opening = lambda description: connecting
    old, lab.eeg = lab.eeg, Sender("amp", "EEG", labels=(*LABELS, "TRIGGER"), sfreq=SFREQ, source_id="amp2")
    old.close()
    lab.typed()
    lab.network.outlets[lab.network.outlets.index(old)] = lab.eeg
    before = len(lab.trials)
    # Longer than it may be silent: it is there.
    lab.run(8.0 + OnlineOptions().lost_s + 2.0)
    assert "the EEG is back" not in lab.told
    assert len(lab.trials) > before
    connecting.set_result(opens(lab.eeg.description).result())
    lab.run()
    assert "the EEG is back" in lab.told
    assert lab.trials[-2]["update"]


def test_eeg_that_comes_back_of_another_kind_is_refused():
    lab = Lab(moves(episodes=2))
    lab.run(8.0)
    lab.eeg.close()
    lab.network.outlets[0] = Sender("amp", "EEG", labels=("Fz", "Cz"), sfreq=SFREQ, source_id="amp2")
    with pytest.raises(HardwareError, match=r"does not serve 'amp'.*lacks Pz, O1, EOG1"):
        lab.run()


def test_an_edge_as_late_as_the_amplifiers_delay_and_the_window_together_is_waited_for():
    lab = Lab(moves(episodes=1), options=OnlineOptions(mode="closed", amp_delay_ms=100.0, snap_s=0.1))
    lab.late = 45  # 180 ms
    lab.run()
    assert {line["zero_from"] for line in lab.trials} == {"trigger"}


def test_no_sample_of_a_run_in_other_units_is_decided_on():
    """LSL goes on with whatever has the same source id."""
    lab = Lab(moves(episodes=2))
    lab.network.recovers = True
    lab.run(8.0)
    lab.eeg.close()
    lab.eeg = Sender("amp", "EEG", labels=(*LABELS, "TRIGGER"), sfreq=SFREQ, source_id="amp")
    lab.typed()
    lab.eeg.description = replace(lab.eeg.description, units=("volts",) * 5 + ("none",))
    taken = lab.loop.deciding._timeline.end
    lab.network.outlets.append(lab.eeg)
    with pytest.raises(HardwareError, match=r"does not serve 'amp'.*volts"):
        lab.run()
    assert lab.loop.deciding._timeline.end == taken


def test_a_sender_whose_clock_is_set_is_told_and_no_move_is_placed_by_the_old_clock():
    def jump(now, stamps, rows):
        return stamps + 100.0 * (now >= 1500), rows

    lab = Lab(moves(episodes=2), spoil=jump)
    set_at = lab.begun + 1500 / SFREQ
    lab.network.on_wait.append(lambda now: setattr(lab.eeg, "offset", -100.0 if now > set_at else 0.0))
    lab.run()
    assert lab.loop.events["clock"] == 1
    assert any("the sender's clock was set by +" in text for text in lab.told)
    undecided = [line for line in lab.trials if line["cause"] in ("clock", "gap", "missing")]
    assert undecided
    for line in lab.trials:
        if line["score"] is not None:
            true = line["zero_stamp"] - (100.0 if line["zero_stamp"] > lab.begun + 50 else 0.0)
            assert true == pytest.approx(line["marker_s"], abs=0.02)
    assert lab.trials[-2]["update"]


def test_where_the_markers_clock_is_set_their_times_are_fixed_anew_within_the_block():
    lab = Lab(moves(episodes=3), trigger=False)
    set_at, push = lab.begun + 6.0, lab.robot.push
    lab.robot.push = lambda stamps, rows: push([one - 0.2 * (one > set_at) for one in stamps], rows)
    lab.network.on_wait.append(lambda now: setattr(lab.robot, "offset", 0.2 if now > set_at else 0.0))
    lab.run()
    assert lab.loop.events["markers' clock"] == 1
    assert any("markers' clock was set" in text for text in lab.told)
    late = [line for line in lab.trials if line["marker_stamp"] > set_at + 5.5]
    assert len(late) > 5
    for line in late:
        assert line["zero_stamp"] == pytest.approx(line["marker_stamp"] + 0.2, abs=2 / SFREQ)


@pytest.mark.parametrize("options", [{"mode": "semi"}, {"mode": "closed", "afresh": True}])
def test_a_block_whose_marker_is_missed_begins_with_its_first_move(options):
    events = moves(episodes=2) + moves(episodes=1, block=2, start_s=24.0, seed=2)
    without = [(at, text) for at, text in events if markers.block_in(text) is None]
    assert len(without) == len(events) - 2
    heard, missed = (Lab(one, options=OnlineOptions(**options)).run() for one in (events, without))
    assert [line["q_after"] for line in missed.trials] == [line["q_after"] for line in heard.trials]
    assert missed.loop.deciding.blocks == heard.loop.deciding.blocks == 2
    assert missed.published[-1].split('"sent_s"')[0] == heard.published[-1].split('"sent_s"')[0]


def test_two_streams_of_markers_are_told_once_and_neither_is_heard():
    lab = Lab(moves(episodes=2))
    lab.robot.close()
    lab.network.outlets += [Sender("hrcneuro-moves", "Markers", source_id=f"robot{i}") for i in range(2)]
    lab.run(4.0)
    assert sum("2 streams are named 'hrcneuro-moves'" in text for text in lab.told) == 1


def test_a_replay_of_which_no_score_could_be_compared_is_not_the_live_session():
    counts = dict.fromkeys(("equal", "different", "undecided", "unrecorded", "unknown"), 0)
    assert as_live(counts)
    assert as_live({**counts, "equal": 5, "unknown": 2})
    assert as_live({**counts, "undecided": 3})
    assert not as_live({**counts, "unknown": 8})
    assert not as_live({**counts, "unrecorded": 8})
    assert not as_live({**counts, "equal": 5, "different": 1})


def test_strange_markers_are_counted_and_not_heeded():
    where = {"scenario": "iC", "block": 1, "episode": 9, "practice": False, "actor": "robot", "next": "N"}
    lab = Lab(moves(episodes=1))
    lab.run(6.0)
    for text, when in (
        (markers.of_move("s02", trial=0, **where), lab.network.now),
        (markers.of_move("s01", trial=1, **where), lab.network.now + 60),
        (markers.of_move("s01", trial=2, **where), lab.network.now - 600),
        ("move/subject=s01/block=x/episode=1/trial=2", lab.network.now),
        (markers.of_move("s01", trial=3, **where), float("nan")),
        ("\x00garbage", lab.network.now),
    ):
        lab.robot.push([when], [[text]])
    lab.run()
    assert lab.loop.hearing.strange == {
        "of another subject": 1, "of the future": 1, "of the past": 1, "without a time": 1
    }  # fmt: skip
    assert len(lab.trials) == 8
    assert lab.causes == {"last": 1}
    assert sum(line["kind"] == "marker" for line in lab.lines) == 4
    json.dumps(lab.lines, allow_nan=False)


def test_a_marker_that_comes_too_late_to_be_in_time_is_decided_and_teaches_nothing():
    where = {"scenario": "iC", "block": 1, "episode": 9, "practice": False, "actor": "robot", "next": "N"}
    lab = Lab(moves(episodes=1))
    lab.run(14.0)
    updates = lab.learner.updates
    lab.robot.push([lab.network.now - 2.0], [[markers.of_move("s01", trial=0, **where)]])
    lab.robot.push([lab.network.now - 9.9], [[markers.of_move("s01", trial=1, **where)]])
    lab.run(15.0)
    assert [line["cause"] for line in lab.trials[-2:]] == ["late", "gone"]
    assert [line["score"] is None for line in lab.trials[-2:]] == [False, True]
    assert lab.learner.updates == updates
    assert not lab.trials[-2]["deadline_met"]


@pytest.mark.parametrize(
    ("made", "words"),
    [
        (decoder(sfreq=500.0), "comes at 250 Hz; the decoder takes 500 Hz"),
        (decoder(channels=("Fz", "Cz", "Pz", "O2", "EOG1")), "lacks O2 and has O1"),
        (decoder(channels=("Cz", "Fz", "Pz", "O1", "EOG1")), "another order"),
    ],
)
def test_a_decoder_for_another_stream_is_refused(made, words):
    with pytest.raises(HardwareError, match=words) as caught:
        Lab(moves(), decoder=made)
    assert caught.value.exit_code == 4
    assert "calibrate" in caught.value.cure


def test_two_streams_of_eeg_and_none_are_refused():
    lab = Lab(moves(), options=OnlineOptions(eeg="amp"))
    lab.network.outlets.append(Sender("amp-2", "EEG", labels=LABELS, sfreq=SFREQ, source_id="twin"))
    network = lab.network
    with pytest.raises(HardwareError, match=r"doubled.*amp-2"):
        find_eeg(network, network.clock, network.wait, decoder(), OnlineOptions())
    with pytest.raises(HardwareError, match=r"missing.*no stream of name 'other'"):
        find_eeg(network, network.clock, network.wait, decoder(), OnlineOptions(eeg="other"))
    with pytest.raises(HardwareError, match="no channel 'TRG'"):
        find_eeg(network, network.clock, network.wait, decoder(), OnlineOptions(eeg="amp", trigger="TRG"))


def test_the_truth_stream_is_never_opened():
    lab = Lab(moves(episodes=1))
    truth = Sender(TRUTH, "Markers", source_id="truth")
    lab.network.outlets.append(truth)
    opened = []
    lab.network.open = lambda description: (
        opened.append(description.name),
        type(lab.network).open(lab.network, description),
    )[1]
    lab.run()
    assert len(lab.trials) == 8
    assert truth.inlets == []
    assert TRUTH not in opened


def test_keys_that_are_told_of_on_the_markers_stream_change_nothing():
    events = moves(episodes=2)
    keys = [
        (at + after, markers.of_key("s01", key, ignored))
        for number, (at, _) in enumerate(events)
        for key, after, ignored in (("N", 0.2, ""), ("NESW"[number % 4], 0.4, "the_robot's_turn"))
    ]
    assert Lab(events + keys).run().lines == Lab(events).run().lines


def test_the_end_marker_ends_the_loop_when_all_is_decided():
    lab = Lab(moves(episodes=1))
    lab.run(lab.events[-1][0] + 0.3)
    lab.robot.push([lab.network.now], [[markers.of_end("s01")]])
    lab.network.wait(0.01)
    lab.loop.step()
    assert not lab.loop.over
    lab.run()
    assert lab.loop.over


def test_the_end_of_another_subjects_session_ends_nothing():
    lab = Lab(moves(episodes=1))
    lab.run(lab.events[-1][0] + 0.3)
    lab.robot.push([lab.network.now], [[markers.of_end("s011")]])
    lab.run()
    assert not lab.loop.over
    assert lab.loop.hearing.strange == {"of another subject": 1}
    lab.robot.push([lab.network.now], [[markers.of_end("s01")]])
    lab.loop.step()
    assert lab.loop.over


def test_a_policy_that_would_be_forgotten_whenever_it_is_to_be_taken_up_is_refused():
    (said,) = check_online(OnlineOptions(mode="semi", afresh=True))
    assert "afresh" in said
    assert check_online(OnlineOptions(mode="semi")) == check_online(OnlineOptions(mode="closed", afresh=True)) == []


# --- a recording ---------------------------------------------------------------------------------------------------


def test_a_replay_gives_the_scores_of_the_live_session_and_of_the_offline_chain_whatever_the_chunks(tmp_path):
    events = moves(episodes=2)
    drop = sample(events[5][0] + 0.2, 20)
    lab = Lab(events, folder=tmp_path / "rec", spoil=spoiled(drop, "drop"), offset=3.5).run()
    live = lab.trials
    assert lab.causes == {"gap": 1, "last": 2}
    known = decisions.known(log_of(lab, tmp_path / "log"))
    for chunk in CHUNKS:
        lines, one = again(tmp_path / "rec", lab.options, chunk, known)
        for name in ("marker", "score", "probability", "predicted", "update", "policy_after", "q_after", "zero_stamp"):
            assert [line[name] for line in lines] == [line[name] for line in live], name
        assert one.policy() == lab.learner.policy()

    # From the recording alone, through the functions that calibrate uses.
    streams, _ = pyxdf.load_xdf(
        str(tmp_path / "rec" / "part1.xdf"), synchronize_clocks=False, dejitter_timestamps=False
    )
    eeg = next(stream for stream in streams if stream["info"]["type"][0] == "EEG")
    stamps, values = eeg["time_stamps"], eeg["time_series"].T[: len(LABELS)]
    edges = [int(at) + 1 for at in np.flatnonzero(np.diff(stamps) > 1.5 / SFREQ)]
    by_chunk = []
    for chunk in CHUNKS:
        lines, _ = again(tmp_path / "rec", lab.options, chunk)
        zeros = np.array([np.searchsorted(stamps, line["zero_stamp"]) for line in lines if line["zero_stamp"]], float)
        pieces = (values[:, at : at + chunk] for at in range(0, values.shape[1], chunk))
        found = dict(offline.epochs(decoder(), pieces, zeros, breaks=edges))
        expected = [
            None if isinstance(found[i], State) else decoder().decide(found[i], line["problem"]).score
            for i, line in enumerate(line for line in lines if line["zero_stamp"])
        ]
        assert expected == [line["score"] for line in lines if line["zero_stamp"]]
        assert sum(one is not None for one in expected) == 15
        by_chunk.append([line["score"] for line in lines])
    assert all(scores == by_chunk[0] for scores in by_chunk)


def test_a_recording_that_began_after_the_loop_gives_its_scores_from_the_next_block_on(tmp_path):
    """The live filter had heard more: it goes on from what the log tells of it at the block's beginning."""
    second = moves(episodes=1, block=2, seed=2, start_s=20.0)
    lab = Lab(moves(episodes=1) + second, folder=tmp_path / "rec", offset=3.5).run()
    known = decisions.known(log_of(lab, tmp_path / "log"))
    ((eeg, marks),) = replaying.read(tmp_path / "rec", lab.options)
    cut = round(6.0 * SFREQ)  # in the first block
    late = replace(eeg, stamps=eeg.stamps[cut:], values=eeg.values[cut:])
    for chunk in CHUNKS:
        lines = []
        loops = replaying.replay(
            [(late, marks)], decoder(), learner(), lab.options, subject="s01", chunk=chunk,
            publish=lambda text, stamp: None, log=lines.append, known=known,
        )  # fmt: skip
        counts = compared(lines, known)
        assert counts == {"equal": 8, "different": 0, "undecided": 0, "unrecorded": 8, "unknown": 0}
        assert loops[0].decided == 8
    # Without what the log tells the filter begins at rest, and forgets that only in time.
    known.states[:] = [one for one in known.states if one[1] is None]
    lines = []
    replaying.replay(
        [(late, marks)], decoder(), learner(), lab.options, subject="s01", chunk=10,
        publish=lambda text, stamp: None, log=lines.append, known=known,
    )  # fmt: skip
    assert compared(lines, known)["different"] > 0


def test_a_replay_learns_not_from_what_was_late_live(tmp_path):
    lab = Lab(moves(episodes=1), folder=tmp_path / "rec", options=OnlineOptions(mode="closed", deadline_s=0.6)).run()
    assert lab.causes == {"late": 8}
    known = decisions.known(log_of(lab, tmp_path / "log"))
    lines, one = again(tmp_path / "rec", lab.options, 40, known)
    assert [line["score"] for line in lines] == [line["score"] for line in lab.trials]
    assert one.updates == 0
    assert again(tmp_path / "rec", lab.options, 40)[1].updates == 7


def test_what_is_no_recording_is_refused(tmp_path):
    with pytest.raises(DataError, match=r"no part1\.xdf"):
        replaying.read(tmp_path, OnlineOptions())
    (tmp_path / "part1.xdf").write_bytes(b"XDF: and no more")
    with pytest.raises(DataError, match=r"part1\.xdf"):
        replaying.read(tmp_path, OnlineOptions())


def test_a_log_that_a_crash_has_cut_is_read_to_there(tmp_path):
    lab = Lab(moves(episodes=1)).run()
    path = log_of(lab, tmp_path / "log")
    whole = decisions.known(path)
    path.write_text(path.read_text()[:-30] + "\n[]\n")
    cut = decisions.known(path)
    assert len(whole.scores) == 8
    assert len(cut.scores) == 7
    assert cut.starts == whole.starts
