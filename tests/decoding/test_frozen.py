"""The frozen decoder: the same bits from a stream as from a recording, and no stream of another kind."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hrcneuro.decoding import frozen_refusals, offline
from hrcneuro.decoding.features import ONLINE_MEAN_S, WINDOWS_S, window_means
from hrcneuro.decoding.frozen import FrozenDecoder, FrozenProblem, sigmoid, windows
from hrcneuro.decoding.refusals import NotFiniteTrialsError
from hrcneuro.eeg.causal import State, design

SFREQ = 250.0
CHANNELS = tuple(f"E{i}" for i in range(7)) + ("EOG1",)
UNITS = ["microvolts"] * len(CHANNELS)


def decoder(seed=0, sfreq=SFREQ):
    rng = np.random.default_rng(seed)
    matrix = rng.normal(0, 0.3, (6, len(CHANNELS)))
    matrix[:, 2] = 0  # a bad channel
    n = 6 * len(WINDOWS_S)
    problems = {
        name: FrozenProblem((f"{name}1", f"{name}2"), actor, rng.normal(0, 0.1, n), 0.25, 0.8, -0.1)
        for name, actor in (("HHvsHR", "human"), ("RRvsRH", "robot"))
    }
    return FrozenDecoder(
        CHANNELS, sfreq, (0.1, 40.0), design(sfreq, 0.1, 40.0), matrix, CHANNELS[:6], windows(sfreq), 200.0, problems
    )


ONE = decoder()


def recording(seed=1, seconds=20):
    rng = np.random.default_rng(seed)
    n = int(seconds * SFREQ)
    return (rng.normal(0, 8, (len(CHANNELS), n)) + 2000 * rng.random((len(CHANNELS), 1))).astype(np.float32)


def chunks(x, lengths):
    at, turn = 0, 0
    while at < x.shape[1]:
        yield x[:, at : at + lengths[turn % len(lengths)]]
        at, turn = at + lengths[turn % len(lengths)], turn + 1


def decided(x, lengths, zeros, *, breaks=()):
    """Return each epoch's decisions, or why there is none."""
    return {
        i: one if isinstance(one, State) else tuple(ONE.decide(one, name) for name in ONE.problems)
        for i, one in offline.epochs(ONE, chunks(x, lengths), np.asarray(zeros), breaks=breaks)
    }


ZEROS = np.sort(np.random.default_rng(2).uniform(0, 19 * SFREQ, 30))


@pytest.mark.parametrize("length", [1, 7, 10, 40, 1000])
def test_decisions_are_the_same_to_the_last_bit_whatever_the_chunks(length):
    x = recording()
    whole = decided(x, [x.shape[1]], ZEROS)
    assert decided(x, [length], ZEROS) == whole
    assert len({one[0].score for one in whole.values()}) == 30


@settings(deadline=None, max_examples=15)
@given(
    st.lists(st.integers(1, 700), min_size=1, max_size=5),
    st.lists(st.integers(1, 4999), max_size=3),
    st.lists(st.floats(-300, 5300), min_size=1, max_size=12),
)
def test_so_they_are_with_breaks_and_with_epochs_that_are_not_there(lengths, breaks, zeros):
    x = recording(3)
    whole = decided(x, [5000], zeros, breaks=breaks)
    assert decided(x, lengths, zeros, breaks=breaks) == whole
    for i, zero in enumerate(zeros):
        first, last = ONE.first(zero), ONE.last(zero)
        if first < 0:
            assert whole[i] is State.GONE
        elif last >= 5000:
            assert whole[i] is State.COMING
        else:
            assert (whole[i] is State.BROKEN) == any(first < at <= last for at in breaks)


def test_an_epoch_is_there_as_soon_as_its_last_sample_is():
    x, pushed = recording(), 0

    def counted():
        nonlocal pushed
        for chunk in chunks(x, [10]):
            pushed += 10
            yield chunk

    for i, epoch in offline.epochs(ONE, counted(), ZEROS):
        assert epoch.shape == (8, 150)
        assert pushed - 10 <= ONE.last(ZEROS[i]) < pushed


def test_a_decision_is_the_score_of_the_cleaned_epoch_s_window_means():
    x = recording()
    ((_, epoch),) = offline.epochs(ONE, [x], np.array([1000.4]))
    times = np.arange(ONE.n_times) / SFREQ
    rows = window_means((ONE.matrix @ epoch)[None], times, mean_window_s=ONLINE_MEAN_S)[0]
    for name, problem in ONE.problems.items():
        found = ONE.decide(epoch, name)
        assert found.score == pytest.approx(rows @ problem.weights + 0.25, abs=1e-9)
        assert found.probability == pytest.approx(1 / (1 + np.exp(-(0.8 * found.score - 0.1))))
        assert found.takeover == (found.score > 0)
    clean = ONE.matrix @ epoch
    assert found.peak_uv == pytest.approx(np.abs(clean - clean.mean(axis=1, keepdims=True)).max())


def test_samples_of_another_layout_decide_alike():
    epoch = np.random.default_rng(5).normal(0, 5, (8, 150))
    first = ONE.decide(epoch, "HHvsHR")
    assert ONE.decide(np.asfortranarray(epoch), "HHvsHR") == first
    assert ONE.decide(np.repeat(epoch, 2, axis=1)[:, ::2], "HHvsHR") == first


def test_an_artefact_is_told_and_what_is_no_number_refused():
    epoch = np.random.default_rng(5).normal(0, 5, (8, 150))
    assert not ONE.decide(epoch, "RRvsRH").artefact
    assert ONE.decide(100 * epoch, "RRvsRH").artefact
    epoch[4, 149] = np.nan
    with pytest.raises(NotFiniteTrialsError):
        ONE.decide(epoch, "RRvsRH")
    with pytest.raises(ValueError, match=r"shape \(8, 149\); the decoder takes \(8, 150\)"):
        ONE.decide(epoch[:, 1:], "RRvsRH")


def test_a_broken_electrode_whose_channel_is_not_read_harms_nothing():
    x = recording()
    whole = decided(x, [10], ZEROS)
    x[2, 100:4000] = np.nan
    assert decided(x, [10], ZEROS) == whole
    x[3, 2000] = np.inf
    broken = [i for i, zero in enumerate(ZEROS) if ONE.first(zero) <= 2000 <= ONE.last(zero)]
    assert broken
    for lengths in ([7], [5000]):
        got = decided(x, lengths, ZEROS)
        assert sorted(i for i, one in got.items() if one is State.BROKEN) == broken


def test_a_stream_of_its_kind_is_served_with_other_channels_beside():
    assert ONE.rows(CHANNELS, UNITS, SFREQ) == list(range(8))
    with_triggers = ["TRIGGER", *CHANNELS]
    assert ONE.rows(with_triggers, ["", *UNITS], SFREQ, beside={"TRIGGER"}) == list(range(1, 9))
    assert ONE.rows(CHANNELS, ["uV", "µV", "μV", " microvolt"] * 2, SFREQ * (1 + 1e-7)) == list(range(8))


SWAPPED = (CHANNELS[1], CHANNELS[0], *CHANNELS[2:])


@pytest.mark.parametrize(
    ("channels", "units", "sfreq", "error", "said"),
    [
        (
            CHANNELS[:-1],
            UNITS,
            SFREQ,
            frozen_refusals.OtherChannelsError,
            "lacks EOG1; the decoder takes these 8 channels: E0",
        ),
        ((*CHANNELS, "TRIGGER"), [*UNITS, ""], SFREQ, frozen_refusals.OtherChannelsError, "has TRIGGER beside them"),
        ((*CHANNELS[:-1], "VEOG"), UNITS, SFREQ, frozen_refusals.OtherChannelsError, "lacks EOG1 and has VEOG beside"),
        ((*CHANNELS, "E0"), [*UNITS, "uV"], SFREQ, frozen_refusals.OtherChannelsError, "names E0 twice"),
        (SWAPPED, UNITS, SFREQ, frozen_refusals.OtherOrderError, "channel 1 is E1; the decoder takes E0 there"),
        (CHANNELS, ["V"] * 8, SFREQ, frozen_refusals.OtherUnitError, "8 channels .* E0, in 'V'; the decoder takes µV"),
        (CHANNELS, [*UNITS[:-1], ""], SFREQ, frozen_refusals.OtherUnitError, "1 channels .* EOG1, in ''"),
        (CHANNELS, UNITS, 256.0, frozen_refusals.OtherRateError, "256 Hz; the decoder takes 250 Hz"),
    ],
)
def test_a_stream_of_another_kind_is_refused(channels, units, sfreq, error, said):
    with pytest.raises(error, match=said):
        ONE.rows(channels, units, sfreq)
    assert issubclass(error, frozen_refusals.StreamError)


def test_the_actor_of_a_move_says_which_problem_is_decided():
    assert (ONE.problem_of("human"), ONE.problem_of("robot")) == ("HHvsHR", "RRvsRH")
    with pytest.raises(KeyError, match="0 problems are decided after a move of 'nobody'"):
        ONE.problem_of("nobody")
    any_actor = {"only": replace(ONE.problems["HHvsHR"], actor="")}
    assert replace(ONE, problems=any_actor).problem_of("robot") == "only"


@pytest.mark.parametrize("sfreq", [100.0, 128.0, 250.0, 500.0, 512.0, 1000.0, 999.995])
def test_an_epoch_holds_the_samples_before_600_ms_and_no_more(sfreq):
    found = windows(sfreq)
    assert (found.shape[1] - 1) / sfreq < 0.6 - 1e-6
    assert found.shape[1] / sfreq >= 0.6 - 1e-5
    np.testing.assert_allclose(found.sum(axis=1), 0, atol=1e-12)


def test_a_probability_does_not_overflow():
    assert (sigmoid(-1e4), sigmoid(0.0), sigmoid(1e4)) == (0.0, 0.5, 1.0)
