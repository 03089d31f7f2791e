from fractions import Fraction

import mne
import numpy as np
import pandas as pd
import pytest

from hrcneuro.contract import Inputs, params
from hrcneuro.eeg.epochs import REASONS
from hrcneuro.eeg.resample import ratio
from hrcneuro.errors import DataError
from hrcneuro.io import fif
from hrcneuro.io.tables import describe, read_table, write_table
from hrcneuro.stages import epoch
from hrcneuro.stages.epoch import Config
from hrcneuro.tables.quality import TIMING
from hrcneuro.tables.trials import TRIALS

# MNE itself sets an index in place when it reads metadata, which pandas 3 deprecates.
pytestmark = pytest.mark.filterwarnings("ignore:The inplace keyword")

CASES = ["HH", "HR", "RR", "RH"]


def study(n=60, source=1000.0, step_s=1.3):
    """Moves 1.3 s apart: practice, then iC, then sC; every pair counts, conditions go round."""
    before = [CASES[i % 4] for i in range(n)]
    scenario = ["iC" if i < n // 2 else "sC" for i in range(n)]
    onset_s = 2.0011 + step_s * np.arange(n)
    table = pd.DataFrame(
        {
            "subject": "s01", "event": "move", "scenario": scenario, "practice": np.arange(n) < 4, "block": 1,
            "episode": 1, "trial": range(n), "actor": "human", "intended": "N", "executed": "N", "target": "N",
            "error": np.arange(n) % 5 == 0, "row": 3, "col": 3, "key_wrong": False, "onset_s": onset_s,
            "onset_sample": np.rint(onset_s * source).astype(int), "t_f_s": 0.8, "case": [None, *before[:-1]],
            "condition_before": before, "condition_after": [None, *before[:-1]], "prev_error": False, "turn": True,
            "soa_s": step_s,
        }
    )  # fmt: skip
    table.loc[n - 1, "condition_before"] = None
    return table


def events(source=128.0):
    onset_s = np.array([0.1, 3.0, 4.5, 4.502, 8.25])
    table = pd.DataFrame({"subject": "demo", "event": ["rt", "square", "rt", "square", "square"], "onset_s": onset_s})
    table["onset_sample"] = np.rint(onset_s * source).astype(int)
    table["soa_s"] = [*np.diff(onset_s), np.nan]
    for name in TRIALS.columns:
        if name not in table:
            table[name] = None
    return table


@pytest.fixture
def product(tmp_path):
    """A function that runs the stage on trials and a made-up clean recording; returns its summary and folder."""

    def run(trials, config=Config(), *, source=1000.0, seconds=90, unit="s01", marks=(), spoil=None, out="out"):  # noqa: B008
        made = ratio(source, 512)
        n_source = int(seconds * source)
        data = 1e-5 * np.random.default_rng(2).standard_normal((4, made.length(n_source)))
        if spoil:
            spoil(data)
        raw = mne.io.RawArray(data, mne.create_info(["Fz", "Cz", "Pz", "Oz"], made.sfreq, "eeg"), verbose="error")
        if marks:
            raw.set_annotations(mne.Annotations(*zip(*marks, strict=True)))
        acquire, preprocess, target = (tmp_path / name for name in ("acquire", "preprocess", out))
        for folder in (acquire, preprocess, target):
            folder.mkdir(exist_ok=True)
        write_table(trials, acquire / "trials.parquet", TRIALS)
        fif.write_raw(raw, preprocess / f"{unit}_clean_raw.fif")
        timing = {"source_sfreq": source, "sfreq": made.sfreq, "up": made.up, "down": made.down, "n_source": n_source}
        write_table(pd.DataFrame([timing | {"n_samples": data.shape[1]}]), preprocess / "timing.parquet", TIMING)
        return epoch.run(config, Inputs.of(unit, acquire=acquire, preprocess=preprocess), target), target

    return run


def test_defaults_are_the_papers():
    assert params(Config()) == {"tmin": -0.2, "tmax": 1.2, "reject_uv": 1000.0, "outlier_share": 0.1}
    assert epoch.check(Config()) == []
    assert "must lie before" in epoch.check(Config(tmin=0.5, tmax=0.5))[0]


def test_every_wanted_move_once_with_its_row(product):
    trials = study()
    summary, out = product(trials)
    epochs = fif.read_epochs(out / "s01_epo.fif")
    assert epochs.get_data(copy=False).shape == (56, 4, 717)
    assert epochs.baseline is None
    assert epochs.tmin == pytest.approx(-102 / 512)
    wanted = trials.iloc[4:].reset_index(drop=True)
    assert epochs.metadata["trial"].tolist() == wanted["trial"].tolist()
    assert epochs.metadata["error"].tolist() == wanted["error"].tolist()
    np.testing.assert_allclose(epochs.metadata["soa_s"], 1.3)
    assert len(epochs.metadata.query("condition_before == 'HH'")) == summary["total"]["HH"]
    assert summary["epochs"] == 56
    assert (summary["samples"], summary["sfreq"]) == (717, 512.0)


def test_tags_select_conditions(product):
    summary, out = product(study())
    epochs = fif.read_epochs(out / "s01_epo.fif")
    assert "iC/before_RH/after_RR" in epochs.event_id
    for scenario, counts in summary["counts"].items():
        for case, n in counts.items():
            assert len(epochs[f"{scenario}/before_{case}"]) == n
    assert len(epochs["sC/after_RR"]) == (epochs.metadata.query("scenario == 'sC'")["condition_after"] == "RR").sum()
    assert len(epochs["sC"]) == 30


def test_summary_has_all_cases_and_says_which_are_empty(product):
    trials = study()
    trials.loc[trials["condition_before"] == "HR", "condition_before"] = None
    summary, _ = product(trials)
    assert {s: list(c) for s, c in summary["counts"].items()} == {"iC": CASES, "sC": CASES}
    assert summary["counts"]["iC"]["HR"] == summary["total"]["HR"] == 0
    assert summary["total"]["RR"] == summary["counts"]["iC"]["RR"] + summary["counts"]["sC"]["RR"] > 0
    assert summary["warnings"] == ["no epoch of HR (before) in iC", "no epoch of HR (before) in sC"]
    assert summary["rejected"] == 0


def test_samples_are_right_to_half_a_sample(product):
    trials = study()
    spikes = [round(s * 0.512) for s in trials["onset_sample"]]

    def spoil(data):
        data[:] = 0
        data[0, spikes] = 1e-4

    _, out = product(trials, spoil=spoil)
    epochs = fif.read_epochs(out / "s01_epo.fif")
    assert epochs.get_data()[:, 0].argmax(axis=1).tolist() == [102] * 56
    exact = [Fraction(s) * 64 / 125 for s in trials["onset_sample"].tolist()[4:]]
    assert all(abs(e - a) <= Fraction(1, 2) for e, a in zip(epochs.events[:, 0].tolist(), exact, strict=True))


def test_equal_to_mnes_own_epochs(product, tmp_path):
    trials = study()
    _, out = product(trials)
    raw = fif.read_raw(tmp_path / "preprocess" / "s01_clean_raw.fif")
    ours = fif.read_epochs(out / "s01_epo.fif")
    theirs = mne.Epochs(raw, ours.events, ours.event_id, -0.2, 1.2, baseline=None, preload=True, verbose="error")
    np.testing.assert_allclose(ours.get_data(), theirs.get_data(), rtol=1e-6)


def test_reasons_are_counted_and_kept_in_the_drop_log(product):
    trials = study()
    trials["onset_sample"] = trials["onset_sample"].astype("Int64")
    trials.loc[20, "onset_sample"] = None

    def spoil(data):
        data[2, round((2.0011 + 1.3 * 30) * 512)] = -1.1e-3

    # An epoch of 1.4 s every 1.3 s: for 0.1 s two of them overlap.
    at, bad = 1.85 + 1.3 * 40, 1.85 + 1.3 * 50
    marks = [(at, 0.0, "BAD boundary"), (at, 0.0, "EDGE boundary"), (bad, 0.01, "BAD loose")]
    summary, out = product(trials, seconds=78.9, marks=marks, spoil=spoil)
    assert summary["reasons"] == {"amplitude": 1, "boundary": 2, "marked": 2, "no onset": 1, "outside": 1}
    assert summary["rejected"] == 7
    assert summary["epochs"] == 49
    epochs = fif.read_epochs(out / "s01_epo.fif")
    assert [i + 4 for i, log in enumerate(epochs.drop_log) if log] == [20, 30, 39, 40, 49, 50, 59]
    assert epochs.drop_log[26] == ("amplitude",)
    assert (epochs.selection + 4).tolist() == epochs.metadata["trial"].tolist()


def test_conditions_table(product):
    def spoil(data):
        data[0, round((2.0011 + 1.3 * 30) * 512)] = 2e-3

    summary, out = product(study(), spoil=spoil)
    table = read_table(out / "conditions.parquet")
    assert len(table) == 2 * 2 * 4
    assert table["kept"].sum() + table["rejected"].sum() == 2 * 56 - 1
    assert table["amplitude"].sum() == table["rejected"].sum() == 2
    before = table[table["position"] == "before"].set_index(["scenario", "case"])["kept"]
    assert all(before[s, c] == n for s, counts in summary["counts"].items() for c, n in counts.items())
    columns = describe(out / "conditions.parquet").columns
    assert {reason.replace(" ", "_") for reason in REASONS} <= set(columns)


def test_an_outlier_is_called_one_but_kept(product):
    def spoil(data):
        data[0, : data.shape[1] // 4] *= 400

    summary, _ = product(study(), spoil=spoil)
    assert summary["outlier"] is True
    assert summary["amplitude_share"] > 0.1
    assert any("exceed 1000 µV (limit 10%): an outlier" in text for text in summary["warnings"])
    summary, _ = product(study(), Config(outlier_share=1.0), spoil=spoil, out="tolerant")
    assert summary["outlier"] is False
    summary, _ = product(study(), Config(reject_uv=1e6), spoil=spoil, out="blind")
    assert summary["rejected"] == 0


def test_another_study(product):
    summary, out = product(events(), source=128.0, seconds=10, unit="demo")
    assert summary["counts"] == {"all": {"rt": 1, "square": 3}}
    assert summary["total"] == {"rt": 1, "square": 3}
    assert summary["reasons"] == {"outside": 1}
    epochs = fif.read_epochs(out / "demo_epo.fif")
    assert epochs.event_id == {"rt": 1, "square": 2}
    assert len(epochs["square"]) == 3
    assert epochs.get_data(copy=False).shape[2] == 181
    assert epochs.metadata["event"].tolist() == ["square", "rt", "square", "square"]
    # Two events of one sample: MNE wants distinct numbers, the cut is the same.
    assert np.diff(epochs.events[:, 0]).min() == 1
    np.testing.assert_array_equal(epochs.get_data()[1], epochs.get_data()[2])
    table = read_table(out / "conditions.parquet")
    assert table["position"].unique().tolist() == ["event"]


def test_same_input_same_bytes(product):
    one, two = (product(study(), out=name)[1] for name in ("one", "two"))
    for name in ("s01_epo.fif", "conditions.parquet"):
        assert (one / name).read_bytes() == (two / name).read_bytes()


def test_nothing_to_cut(product):
    trials = study()
    trials["condition_before"] = trials["condition_after"] = None
    with pytest.raises(DataError, match=r"no trial to cut .*\n.*--inspect"):
        product(trials)
    with pytest.raises(DataError, match="no trial to cut"):
        product(events().iloc[:0], unit="demo", out="again")


def test_no_good_epoch(product):
    with pytest.raises(DataError, match=r"none of 56 epochs is good: 56 amplitude"):
        product(study(), Config(reject_uv=1.0))


def test_timing_of_another_run(product, tmp_path):
    product(study())
    path = tmp_path / "preprocess" / "timing.parquet"
    timing = read_table(path)
    timing["n_samples"] += 1
    write_table(timing, path, TIMING)
    inputs = Inputs.of("s01", acquire=tmp_path / "acquire", preprocess=tmp_path / "preprocess")
    with pytest.raises(DataError, match=r"46080 samples, timing.parquet says 46081\n.*preprocess s01 --force"):
        epoch.run(Config(), inputs, tmp_path / "out")
