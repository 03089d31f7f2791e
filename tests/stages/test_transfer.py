"""The stage from epochs, and from a recording as a stream would bring it, to tables; refusals."""

import dataclasses
import json
import sys

import numpy as np
import pytest
from epoch_factory import CHANNELS, trial_table, write_subject
from threadpoolctl import threadpool_limits

from hrcneuro import answers
from hrcneuro.analyses import calibrated
from hrcneuro.contract import Inputs
from hrcneuro.decoding.features import window_means
from hrcneuro.eeg.synthetic import SyntheticParams
from hrcneuro.errors import ConfigError, DataError
from hrcneuro.io.fif import read_raw
from hrcneuro.io.tables import describe, read_lists, read_table
from hrcneuro.io.trials import read_trials
from hrcneuro.paradigm.params import SessionParams, TimingParams
from hrcneuro.stages import acquire, epoch, preprocess, transfer
from hrcneuro.stages.transfer import Config
from hrcneuro.tables.transfer import COMPARED, CURVES, SCORES, TESTS, TRIALS

pytest.importorskip("pyriemann", reason="needs the extra decoders")
pytestmark = pytest.mark.filterwarnings("ignore:The inplace keyword:DeprecationWarning")
OFFLINE = Config(signals=("offline",), pairs=(5,), draws=2)


@pytest.fixture(scope="module", autouse=True)
def one_thread():
    """As a stage runs."""
    with threadpool_limits(1):
        yield


def moves(seed, n=320):
    """Trials of blocks that lie apart, sC and iC in turns."""
    rng = np.random.default_rng(seed)
    blocks = 1 + np.arange(n) * 8 // n
    onsets = 100.0 * blocks + 1.1 * np.arange(n)
    return trial_table(rng, n).assign(block=blocks, scenario=np.where(blocks % 2, "sC", "iC"), onset_s=onsets)


def subjects(folder, n=6, config=OFFLINE, channels=lambda i: CHANNELS, **options):
    """Run n subjects; return unit -> folder of what transfer wrote."""
    units = {}
    for i in range(n):
        unit = f"s{i + 1:02d}"
        write_subject(folder / "epoch" / unit, unit, seed=i, table=moves(i), channels=channels(i), **options)
        units[unit] = folder / "transfer" / unit
        units[unit].mkdir(parents=True)
        transfer.run(config, Inputs.of(unit, epoch=folder / "epoch" / unit), units[unit])
    return units


def group(units, out, config=OFFLINE):
    out.mkdir()
    return transfer.run_group(config, Inputs.of("group", transfer=dict(units)), out)


@pytest.fixture(scope="module")
def planted(tmp_path_factory):
    """Six subjects of whom RH_before alone has an effect."""
    return subjects(tmp_path_factory.mktemp("planted"), effect_uv=12.0)


@pytest.fixture(scope="module")
def decoded(planted, tmp_path_factory):
    out = tmp_path_factory.mktemp("decoded") / "group"
    return group(planted, out), out


def baccs(out, way, calibration):
    tests = read_table(out / "tests.parquet")
    own = tests[(tests["way"] == way) & (tests["calibration"] == calibration)]
    return own.set_index(["scenario", "problem"])["bacc"]


@pytest.mark.parametrize(("way", "calibration"), [("pooled", "none"), ("recentred", "none"), ("recentred", "all")])
def test_a_planted_effect_is_found_in_people_whom_no_decoder_has_seen_and_only_where_it_is(decoded, way, calibration):
    found = baccs(decoded[1], way, calibration)
    for scenario in ("iC", "sC"):
        assert found[scenario, "RRvsRH"] > 65
        # About 480 trials of six people: four standard errors of 2.4 points.
        assert abs(found[scenario, "HHvsHR"] - 50) < 9.6


def test_its_tables_are_as_declared_and_the_summary_is_json(decoded, planted):
    summary, out = decoded
    declared = {"scores": SCORES, "curves": CURVES, "tests": TESTS, "compared": COMPARED}
    for name, table in declared.items():
        found = describe(out / f"{name}.parquet")
        assert (found.version, found.row, list(found.columns)) == (table.version, table.row, list(table.columns))
    assert describe(planted["s01"] / "trials.parquet").row == TRIALS.row
    json.dumps(summary, allow_nan=False)
    said = "\n".join(answers.lines("transfer", "group", summary))
    assert "RRvsRH, offline" in said
    assert summary["subjects"] == [f"s0{i}" for i in range(1, 7)]
    scores = read_table(out / "scores.parquet")
    assert set(scores["folds"]) == {4}
    assert scores.groupby(["scenario", "problem", "way", "calibration"]).size().eq(6).all()
    own = scores[(scores["way"] == "own") & (scores["scenario"] == "iC")]
    assert (own[own["calibration"] == "5"]["pairs"] == 5).all()
    assert own["minutes"].max() < 3.5  # three blocks of forty trials


def test_shuffled_labels_are_at_chance_in_every_way_and_it_is_said(planted, tmp_path):
    summary = group(planted, tmp_path / "group", dataclasses.replace(OFFLINE, shuffled=True))
    for way, calibration in (("own", "all"), ("pooled", "none"), ("recentred", "all"), ("joint", "all")):
        found = baccs(tmp_path / "group", way, calibration)
        assert (abs(found - 50) < 9.6).all(), way
    assert not read_table(tmp_path / "group" / "tests.parquet")["significant"].any()
    assert any("shuffled" in warning for warning in summary["warnings"])
    assert answers.lines("transfer", "group", summary)[0].startswith("labels were shuffled")


def test_the_same_again_is_the_same(planted, decoded, tmp_path):
    assert group(planted, tmp_path / "group") == decoded[0]
    for name in ("scores", "tests"):
        file = f"{name}.parquet"
        assert (tmp_path / "group" / file).read_bytes() == (decoded[1] / file).read_bytes()


def test_channels_that_not_all_have_are_left_out(tmp_path):
    units = subjects(tmp_path, 3, channels=lambda i: CHANNELS[1:] if i == 1 else CHANNELS)
    summary = group(units, tmp_path / "group")
    assert any("7 of 8 channels" in warning and "s02 lacks Fz" in warning for warning in summary["warnings"])


def test_offline_features_are_the_study_s(tmp_path):
    units = subjects(tmp_path, 1)
    epochs = read_trials(Inputs.of("s01", epoch=tmp_path / "epoch" / "s01"))
    rows = read_table(units["s01"] / "trials.parquet", ["scenario", "problem", "label"])
    values = read_lists(units["s01"] / "trials.parquet", "features_uv")
    chosen = epochs.table.eval("scenario == 'iC' and condition_before in ['RR', 'RH']").to_numpy()
    here = ((rows["scenario"] == "iC") & (rows["problem"] == "RRvsRH")).to_numpy()
    np.testing.assert_allclose(values[here], window_means(epochs.data[chosen], epochs.times), rtol=1e-5, atol=1e-5)
    expected = (epochs.table.loc[chosen, "condition_before"] == "RH").astype(int)
    assert rows.loc[here, "label"].tolist() == expected.tolist()


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A simulated subject, cleaned and cut."""
    folder = tmp_path_factory.mktemp("recorded")
    config = acquire.Config(
        sfreq=128.0,
        contaminated=(),
        session=SessionParams(practice_episodes=1, blocks=4, episodes_per_block=4),
        timing=TimingParams(break_s=1.0, pause_s=1.0),
        eeg=SyntheticParams(dipoles=20),
    )
    for name in ("acquire", "preprocess", "epoch"):
        (folder / name).mkdir()
    acquire.run(config, Inputs.of("s01"), folder / "acquire")
    preprocess.run(preprocess.Config(sfreq=128.0), Inputs.of("s01", acquire=folder / "acquire"), folder / "preprocess")
    of_epoch = Inputs.of("s01", acquire=folder / "acquire", preprocess=folder / "preprocess")
    epoch.run(epoch.Config(), of_epoch, folder / "epoch")
    return Inputs.of("s01", **{name: folder / name for name in ("acquire", "preprocess", "epoch")})


def test_both_signals_show_the_same_trials_the_causal_one_as_a_stream_does(recorded, tmp_path):
    config = Config()
    summary = transfer.run(config, recorded, tmp_path)
    rows = read_table(tmp_path / "trials.parquet", ["signal", "scenario", "problem", "onset_s", "block", "label"])
    values = read_lists(tmp_path / "trials.parquet", "features_uv")
    one, two = (rows[rows["signal"] == signal].reset_index(drop=True) for signal in ("offline", "causal"))
    assert one.drop(columns="signal").equals(two.drop(columns="signal"))
    assert len(one) > 100
    raw = read_raw(recorded.path("acquire", "s01_raw.fif"))
    quality = read_table(recorded.path("preprocess", "quality.parquet"))
    decoder = calibrated.bare(config, raw, calibrated.channels(raw, quality, "eeglab"))
    seen = calibrated.see(raw, decoder, read_table(recorded.path("acquire", "trials.parquet")))
    names = list(read_table(tmp_path / "channels.parquet")["channel"])
    assert names == list(decoder.kept)
    at = {onset: i for i, onset in enumerate(seen.table["onset_s"])}
    expected = seen.features[[at[onset] for onset in two["onset_s"]]]
    np.testing.assert_allclose(values[len(one) :], expected, rtol=1e-5, atol=1e-5)
    # Two filters, two means: alike, and not the same.
    together = np.corrcoef(values[: len(one)].ravel(), expected.ravel())[0, 1]
    assert 0.3 < together < 0.999
    assert sum(sum(n) for cells in summary["trials"].values() for n in cells.values()) == len(one)


def test_a_trial_that_a_stream_does_not_have_is_in_neither_signal(recorded, tmp_path):
    every = transfer.run(Config(), recorded, tmp_path)
    rows = read_table(tmp_path / "trials.parquet", ["signal"])
    fewer = transfer.run(Config(reject_uv=75.0), recorded, tmp_path)
    assert fewer["lost"] > every["lost"]
    counts = read_table(tmp_path / "trials.parquet", ["signal"])["signal"].value_counts()
    assert counts["offline"] == counts["causal"] < len(rows) / 2
    with pytest.raises(DataError, match=r"none of 198 epochs is a trial that a stream has; .*amplitude 198") as caught:
        transfer.run(Config(reject_uv=1.0), recorded, tmp_path)
    assert "transfer.signals = ['offline']" in caught.value.cure


def test_one_subject_alone_is_refused(planted, tmp_path):
    with pytest.raises(DataError, match="nobody is left to learn from: the group is s01 alone") as caught:
        group({"s01": planted["s01"]}, tmp_path / "group")
    assert "two subjects or more" in caught.value.cure


def test_a_subject_with_too_few_trials_is_left_out_and_named(planted, tmp_path):
    short = tmp_path / "epoch"
    write_subject(short, "s09", seed=9, table=moves(9)[:5])
    out = tmp_path / "s09"
    out.mkdir()
    transfer.run(OFFLINE, Inputs.of("s09", epoch=short), out)
    some = {unit: planted[unit] for unit in ("s01", "s02", "s03")}
    summary = group(some | {"s09": out}, tmp_path / "group")
    assert any(warning.startswith("s09, offline, sC") for warning in summary["warnings"])
    scores = read_table(tmp_path / "group" / "scores.parquet")
    assert set(scores["subject"]) == {"s01", "s02", "s03"}


def test_without_pyriemann_it_is_refused_before_anything_runs(monkeypatch):
    monkeypatch.setitem(sys.modules, "pyriemann", None)
    monkeypatch.setitem(sys.modules, "pyriemann.transfer", None)
    with pytest.raises(ConfigError, match="recentring needs the library pyriemann") as caught:
        transfer.ready(Config())
    assert "pip install 'hrcneuro[decoders]'" in caught.value.cure
    assert "leave recentred and joint out of transfer.ways" in caught.value.cure
    transfer.ready(Config(ways=("own", "pooled")))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"ways": ()}, "ways = []: give at least one name"),
        ({"signals": ("causal", "causal")}, "signals = ['causal', 'causal']: give at least one name, and each only"),
        ({"pairs": (5, 2)}, "pairs = [5, 2]: give numbers in rising order"),
        ({"l_freq": 40.0}, "l_freq = 40 Hz must lie below h_freq = 40 Hz"),
    ],
)
def test_contradictions_are_found(changes, words):
    assert transfer.check(Config()) == []
    assert words in transfer.check(Config(**changes))[0]


def test_conditions_that_no_trial_has_are_said(tmp_path):
    write_subject(tmp_path, "s01", seed=0, table=moves(0).assign(condition_before="HH"))
    summary = transfer.run(OFFLINE, Inputs.of("s01", epoch=tmp_path), tmp_path)
    assert any("RH_before" in warning for warning in summary["warnings"])
