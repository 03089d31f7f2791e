"""The stage from a recording to a decoder: its scores bit for bit from a stream, poor input, and what it says."""

import dataclasses
import hashlib
import json
import math

import mne
import numpy as np
import pandas as pd
import pytest
from threadpoolctl import threadpool_limits

from hrcneuro import answers
from hrcneuro.contract import Inputs
from hrcneuro.decoding import offline
from hrcneuro.eeg.causal import State
from hrcneuro.eeg.synthetic import SyntheticParams
from hrcneuro.errors import ConfigError, DataError
from hrcneuro.io import fif
from hrcneuro.io.decoders import read_decoder
from hrcneuro.io.tables import describe, read_table, write_table
from hrcneuro.paradigm.params import SessionParams, TimingParams
from hrcneuro.stages import acquire, calibrate, preprocess
from hrcneuro.stages.calibrate import Config
from hrcneuro.tables.trials import TRIALS

pytestmark = pytest.mark.filterwarnings("ignore:The inplace keyword:DeprecationWarning")
QUICK = Config(draws=3)
TABLES = {
    "baselines.parquet", "blocks.parquet", "channels.parquet", "dropped.parquet", "patterns.parquet", "scores.parquet",
    "strata.parquet", "trials.parquet",
}  # fmt: skip


def simulated(folder, **eeg):
    """Acquire and clean a simulated subject in ``folder``; return the inputs of calibrate."""
    config = acquire.Config(
        sfreq=128.0,
        contaminated=(),
        session=SessionParams(practice_episodes=1, blocks=4, episodes_per_block=5),
        timing=TimingParams(break_s=1.0, pause_s=1.0),
        eeg=SyntheticParams(dipoles=20, **eeg),
    )
    for name in ("acquire", "preprocess"):
        (folder / name).mkdir()
    acquire.run(config, Inputs.of("s01"), folder / "acquire")
    clean = preprocess.Config(sfreq=128.0)
    preprocess.run(clean, Inputs.of("s01", acquire=folder / "acquire"), folder / "preprocess")
    return Inputs.of("s01", acquire=folder / "acquire", preprocess=folder / "preprocess")


@pytest.fixture(scope="module", autouse=True)
def one_thread():
    """As a stage runs."""
    with threadpool_limits(1):
        yield


@pytest.fixture(scope="module")
def planted(tmp_path_factory):
    """A subject with a large anticipation, and a bad electrode."""
    return simulated(tmp_path_factory.mktemp("planted"), effect_uv=40.0, amplitude_sigma=0.0)


@pytest.fixture(scope="module")
def made(planted, tmp_path_factory):
    out = tmp_path_factory.mktemp("made")
    return calibrate.run(QUICK, planted, out), out


def recording_uv(inputs, decoder):
    raw = fif.read_raw(inputs.path("acquire", "{unit}_raw.fif"))
    return fif.read_samples(raw, [raw.ch_names.index(name) for name in decoder.channels], 1e6)


@pytest.mark.parametrize("length", [1, 7, 10, 40, 1000])
def test_the_decoder_gives_the_stage_s_scores_bit_for_bit_whatever_the_chunks(planted, made, length):
    decoder, _ = read_decoder(made[1])
    data = recording_uv(planted, decoder)
    # One sample at a time takes its time: the first minute tells as much.
    data = data[:, : round(60 * decoder.sfreq)] if length == 1 else data
    table = read_table(made[1] / "trials.parquet")
    chunks = (data[:, at : at + length] for at in range(0, data.shape[1], length))
    zeros = table["zero"].to_numpy()
    found = {i: one for i, one in offline.epochs(decoder, chunks, zeros) if not isinstance(one, State)}
    assert len(found) > (10 if length == 1 else 100)
    for i, epoch in found.items():
        row = table.iloc[i]
        assert decoder.first(row["zero"]) == row["first_sample"]
        decision = decoder.decide(epoch, row["problem"])
        assert (decision.score, decision.peak_uv) == (row["frozen_score"], row["peak_uv"])


def test_a_planted_effect_is_found_in_held_out_blocks(made):
    scores = read_table(made[1] / "scores.parquet").set_index("problem")
    # What is planted foretells that the human takes over.
    found = scores.loc["RRvsRH"]
    assert found["bacc"] > 70
    assert found["log_loss"] < 0.9
    assert found["slope"] > 0
    assert scores["actor"].to_dict() == {"HHvsHR": "human", "RRvsRH": "robot"}
    assert (scores["note"] == "").all()
    blocks = read_table(made[1] / "blocks.parquet")
    assert blocks.groupby("problem")["block"].apply(list).tolist() == [[1, 2, 3, 4]] * 2
    assert blocks.groupby("block")["scenario"].first().tolist() == ["iC", "sC", "iC", "sC"]
    counts = blocks.groupby("problem")[["n1", "n2"]].sum()
    assert (counts == scores[["n1", "n2"]]).all(axis=None)


def test_nothing_planted_is_at_chance(tmp_path):
    inputs, out = simulated(tmp_path, effect="none", error_uv=0.0, motor_uv=0.0), tmp_path / "out"
    out.mkdir()
    summary = calibrate.run(QUICK, inputs, out)
    for one in summary["problems"].values():
        # Trials as binomial draws: four standard errors are exceeded once in 16,000.
        assert abs(one["bacc"] - 50) < 4 * one["bacc_se"]


def test_rules_without_eeg_stand_beside(planted, made):
    trials = read_table(made[1] / "trials.parquet")
    rules = read_table(made[1] / "baselines.parquet").set_index(["problem", "rule"])
    for problem, own in trials.groupby("problem"):
        stays = rules.loc[(problem, "stays")]
        assert (stays["tnr"], stays["tpr"], stays["bacc"]) == (100, 0, 50)
        assert stays["acc"] == pytest.approx(100 * (own["label"] == 0).mean())
        for cue in ("prev_error", "turn"):
            right = own[cue].astype(int) == own["label"]
            expected = 50 * (right[own["label"] == 0].mean() + right[own["label"] == 1].mean())
            assert rules.loc[(problem, cue), "bacc"] == pytest.approx(expected)


def test_what_is_handed_on_says_what_it_was_learned_from(planted, made):
    decoder, about = read_decoder(made[1])
    raw = planted.path("acquire", "s01_raw.fif")
    assert about["learned_from"]["acquire/s01_raw.fif"] == hashlib.sha256(raw.read_bytes()).hexdigest()
    assert set(about["learned_from"]) == {"acquire/s01_raw.fif", "acquire/trials.parquet", "preprocess/quality.parquet"}
    assert about["options"]["draws"] == 3
    assert about["summary"] == json.loads(json.dumps(made[0]))
    quality = read_table(planted.path("preprocess", "quality.parquet"))
    bad = quality.loc[quality["interpolated"], "channel"]
    assert len(bad)
    for name in bad:
        assert not decoder.matrix[:, decoder.channels.index(name)].any()
    assert len(decoder.channels) == 30
    assert len(decoder.kept) == 27


def test_artifacts_are_complete_described_and_the_same_bytes_again(planted, made, tmp_path):
    calibrate.run(QUICK, planted, tmp_path)
    assert {p.name for p in tmp_path.iterdir()} == TABLES | {"decoder.npz", "decoder.json"}
    for path in tmp_path.iterdir():
        assert path.read_bytes() == (made[1] / path.name).read_bytes(), path.name
    for name in TABLES:
        assert describe(tmp_path / name).row


def test_the_documented_tables_are_those_that_are_written(made):
    import importlib.util

    from tiny_study import ROOT

    spec = importlib.util.spec_from_file_location("generated", ROOT / "docs" / "generated.py")
    generated = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(generated)
    told = {
        place.removeprefix("sNN/"): generated.table_of(what) for place, what in generated.TABLES["calibrate"].items()
    }
    assert set(told) == TABLES
    for name, table in told.items():
        found = describe(made[1] / name)
        assert (found.version, found.row) == (table.version, table.row)
        assert {n: (c.unit, c.text) for n, c in found.columns.items()} == {
            n: (c.unit, c.text) for n, c in table.columns.items()
        }


def changed(planted, tmp_path, change, *, raw=None):
    """Return the inputs with another trial table, or another recording, and an empty folder."""
    folder, out = tmp_path / "changed", tmp_path / "out"
    for one in (folder, out):
        one.mkdir()
    table = read_table(planted.path("acquire", "trials.parquet"))
    write_table(change(table)[list(TRIALS.columns)], folder / "trials.parquet", TRIALS)
    files = {"trials.parquet": folder / "trials.parquet", "s01_raw.fif": planted.path("acquire", "s01_raw.fif")}
    if raw is not None:
        fif.write_raw(raw, folder / "s01_raw.fif")
        files["s01_raw.fif"] = folder / "s01_raw.fif"
    return dataclasses.replace(planted, files={**planted.files, "acquire": {"s01": files}}), out


def same(table):
    return table


def test_breaks_marks_jolts_and_twins_are_dropped_by_their_reason(planted, tmp_path):
    raw = fif.read_raw(planted.path("acquire", "s01_raw.fif"), preload=True)
    table = read_table(planted.path("acquire", "trials.parquet"))
    wanted = table[table["condition_before"].notna() & ~table["practice"].astype(bool)].reset_index(drop=True)
    onsets = wanted["onset_s"].to_numpy(float)
    chosen = dict(zip(("boundary", "marked", "amplitude"), onsets[[3, 20, 40]], strict=True))
    marks = [(chosen["boundary"] + 0.3, 0.0, "BAD boundary"), (chosen["marked"] + 0.3, 0.1, "BAD cough")]
    raw.set_annotations(raw.annotations + mne.Annotations(*zip(*marks, strict=True)))
    at = round((chosen["amplitude"] + 0.2) * 128)
    raw._data[raw.ch_names.index("Cz"), at : at + 10] += 8e-3

    def change(rows):
        twin = rows[rows["onset_s"] == onsets[60]].assign(onset_s=onsets[60] + 0.05, trial=90)
        return pd.concat([rows, twin], ignore_index=True)

    inputs, out = changed(planted, tmp_path, change, raw=raw)
    summary = calibrate.run(QUICK, inputs, out)
    assert set(summary["dropped"]) == {"boundary", "marked", "amplitude", "twin"}
    dropped = read_table(out / "dropped.parquet")
    assert dropped.loc[dropped["reason"] == "twin", "trial"].tolist() == [90]
    left = set(read_table(out / "trials.parquet")["zero"])
    assert not left & {onset * 128 for onset in chosen.values()}
    assert summary["trials"] + len(dropped) == len(wanted) + 1
    assert "dropped: amplitude" in "\n".join(answers.lines("calibrate", "s01", summary))


def test_blocks_scenarios_and_strata_are_those_asked_for(planted, tmp_path):
    for name, config in {
        "scenario": Config(draws=1, scenarios=("iC",)),
        "blocks": Config(draws=1, blocks=(1, 2)),
        "one": Config(draws=1, blocks=(1,)),
        "matched": Config(draws=1, matched=("prev_error",)),
    }.items():
        out = tmp_path / name
        out.mkdir()
        assert calibrate.check(config) == []
        summary = calibrate.run(config, planted, out)
        trials = read_table(out / "trials.parquet")
        if name == "scenario":
            assert set(trials["scenario"]) == {"iC"}
        if name == "blocks":
            assert set(trials["block"]) == {1, 2}
        if name == "one":
            assert set(trials["block"]) == {1}
            assert set(trials["held_out"]) == {0, 1, 2, 3, 4}
            assert "fifths of the recording" in summary["warnings"][0]


@pytest.mark.parametrize(
    ("config", "kind", "said"),
    [
        (Config(scenarios=("ic",)), ConfigError, "names 'ic'; allowed: iC, sC"),
        (Config(blocks=(11,)), DataError, "no trial to calibrate on: of .* 0 lie in the blocks and scenarios"),
        (Config(h_freq=70.0), ConfigError, "0.1–70 Hz does not fit a sampling rate of 128 Hz"),
        (Config(problems={"x": ("A", "B")}, conditions={"A": "actor == 'human'", "B": "actor == 'human'"}),
         ConfigError, "problem x: .* trials belong to both A and B"),
        (Config(conditions={**Config().conditions, "RH_before": "condition_befor == 'RH'"}), ConfigError, "RH_before"),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_told_with_its_cure(planted, tmp_path, config, kind, said):
    with pytest.raises(kind, match=said) as caught:
        calibrate.run(config, planted, tmp_path)
    assert caught.value.cure


def test_too_few_trials_are_told(planted, tmp_path):
    few = changed(planted, tmp_path, lambda table: table[table["block"].eq(1) & table["episode"].eq(1)])
    with pytest.raises(DataError, match="trials of class 1 and") as caught:
        calibrate.run(QUICK, *few)
    assert "calibrate.blocks" in caught.value.cure


def test_strata_without_values_and_another_recording_s_quality_are_told(planted, tmp_path):
    inputs, out = changed(planted, tmp_path, lambda table: table.assign(turn=None))
    with pytest.raises(DataError, match="not all trials have a value of turn"):
        calibrate.run(Config(matched=("turn",)), inputs, out)
    raw = fif.read_raw(planted.path("acquire", "s01_raw.fif"), preload=True)
    raw.drop_channels(["Pz"])
    inputs, out = changed(planted, tmp_path / "other", same, raw=raw) if (tmp_path / "other").mkdir() is None else None
    with pytest.raises(DataError, match=r"quality\.parquet of preprocess tells of") as caught:
        calibrate.run(QUICK, inputs, out)
    assert "hrcneuro preprocess" in caught.value.cure


def test_contradictions_are_found():
    assert calibrate.check(Config()) == []
    said = calibrate.check(Config(matched=("turns", "turn", "turn"), l_freq=50.0, scenarios=("iC",), split=""))
    assert len(said) == 4
    assert "did you mean 'turn'" in said[0]
    assert "each once" in said[1]
    assert "l_freq = 50 Hz must lie below h_freq = 40 Hz" in said[2]
    assert "scenarios = ['iC']" in said[3]


def test_what_came_out_is_told_in_words(made):
    text = "\n".join(answers.lines("calibrate", "s01", made[0]))
    assert "a decoder for 30 channels at 128 Hz, ready 602 ms after an onset" in text
    for name, one in made[0]["problems"].items():
        assert f"{name}  {one['bacc']:.1f} ± " in text
    assert "the actor stays 50.0 %" in text
    both = answers.together("calibrate", {"s01": made[0], "s02": made[0]})
    assert both[0].startswith("balanced accuracy on held-out blocks of 2 subjects")
    assert not any(math.isnan(v) for one in made[0]["problems"].values() for v in one.values() if isinstance(v, float))


def test_weights_that_were_frozen_are_those_of_the_patterns(made):
    decoder, _ = read_decoder(made[1])
    patterns = read_table(made[1] / "patterns.parquet")
    for name, one in decoder.problems.items():
        own = patterns[patterns["problem"] == name]
        np.testing.assert_array_equal(own["weight"].to_numpy(), one.weights)
        assert list(dict.fromkeys(own["channel"])) == list(decoder.kept)
