"""The stage decode from epochs file to tables and summary, with good and with poor input."""

import hashlib
import itertools
import json
import sys
import tomllib
from dataclasses import replace
from pathlib import Path

import mne
import numpy as np
import pandas as pd
import pytest
from scipy.stats import t

from hrcneuro.contract import Inputs
from hrcneuro.decoding import refusals
from hrcneuro.decoding.recipes import BUILTIN
from hrcneuro.errors import ConfigError, DataError, cured
from hrcneuro.io.fif import write_epochs
from hrcneuro.io.tables import describe, read_table
from hrcneuro.stages import decode

# MNE 1.13 itself uses what pandas 3.1 deprecates when it reads the trial table of a FIF file.
pytestmark = pytest.mark.filterwarnings("ignore:The inplace keyword:DeprecationWarning")

QUICK = decode.Config(decoders=("rlda",), repeats=2, permutations=0)
RATES = ["tnr", "tpr", "acc", "bacc"]


def trial_table(counts: dict[str, dict[str, int]], rng: np.random.Generator) -> pd.DataFrame:
    rows = [(s, case) for s, cases in counts.items() for case, n in cases.items() for _ in range(n)]
    table = pd.DataFrame(rows, columns=["scenario", "condition_before"]).sample(frac=1, random_state=1)
    n = len(table)
    table["block"] = 1 + np.arange(n) * 4 // max(n, 1)
    table["episode"], table["trial"] = np.arange(n) // 10, np.arange(n) % 10
    table["prev_error"], table["turn"] = rng.random(n) < 0.3, rng.random(n) < 0.4
    return table.assign(error=False, event="move").reset_index(drop=True)


def epochs_of(table: pd.DataFrame, *, takeover_uv: float = 0.0, seed: int = 0, sfreq: float = 64.0) -> mne.EpochsArray:
    rng = np.random.default_rng(seed)
    times = np.arange(round(-0.2 * sfreq), round(1.2 * sfreq) + 1) / sfreq
    data = rng.normal(0, 10, (len(table), 6, len(times)))
    if "condition_before" in table:
        takeover = table["condition_before"].isin(["RH"]).to_numpy()
        data[takeover, :2] += takeover_uv * np.exp(-(((times - 0.5) / 0.08) ** 2))
    info = mne.create_info([f"E{i}" for i in range(5)] + ["EOG1"], sfreq, ["eeg"] * 5 + ["eog"])
    events = np.c_[np.arange(len(table)) * 200, np.zeros(len(table), int), np.ones(len(table), int)]
    return mne.EpochsArray(
        data * 1e-6, info, events, tmin=times[0], event_id={"move": 1}, metadata=table, baseline=None, verbose="error"
    )


COUNTS = {"iC": {"HH": 30, "HR": 14, "RR": 40, "RH": 30}, "sC": {"HH": 30, "HR": 12, "RR": 24, "RH": 16}}


@pytest.fixture
def study(tmp_path):
    """Return a function that writes a subject's epochs and decodes them."""

    def run(config=QUICK, *, unit="s01", counts=COUNTS, epochs=None, **kwargs):
        source, out = tmp_path / unit / "epoch", tmp_path / unit / "decode"
        source.mkdir(parents=True, exist_ok=True)
        out.mkdir(exist_ok=True)
        if epochs is None:
            epochs = epochs_of(trial_table(counts, np.random.default_rng(0)), **kwargs)
        write_epochs(epochs, source / f"{unit}_epo.fif")
        assert decode.check(config) == []
        return decode.run(config, Inputs.of(unit, epoch=source), out), out

    return run


def written(study) -> tuple[Inputs, Path]:
    """Return the input and the output folder of a subject whose epochs are on disk."""
    _, out = study()
    return Inputs.of("s01", epoch=out.parent / "epoch"), out


def digests(folder: Path) -> dict[str, str]:
    return {p.name: hashlib.sha256(p.read_bytes()).hexdigest() for p in sorted(folder.iterdir())}


def test_the_artifacts_of_a_subject(study):
    summary, out = study(takeover_uv=9.0)
    assert sorted(p.name for p in out.iterdir()) == [
        "channels.parquet",
        "folds.parquet",
        "patterns.parquet",
        "predictions.parquet",
        "roc.parquet",
        "scores.parquet",
        "strata.parquet",
    ]
    assert set(summary) == {"iC", "sC"}
    assert set(summary["iC"]["RRvsRH"]) == {*RATES, "chance", "p", "n1", "n2", "decoder", "classes"}
    assert summary["iC"]["RRvsRH"]["classes"] == ["RR_before", "RH_before"]
    assert summary["iC"]["RRvsRH"]["bacc"] > 70 > summary["iC"]["HHvsHR"]["bacc"]
    json.dumps(summary, allow_nan=False)

    folds, predictions, scores = (read_table(out / f"{name}.parquet") for name in ("folds", "predictions", "scores"))
    assert len(folds) == 4 * 2 * 10
    assert len(predictions) == 2 * sum(sum(c.values()) for c in COUNTS.values())
    assert folds["n_train"].max() <= 2 * 27, "training sets are drawn down to the smaller class"
    row = scores.set_index(["scenario", "problem"]).loc[("iC", "RRvsRH")]
    assert (row["n1"], row["n2"], row["n_folds"], row["class2"]) == (40, 30, 10, "RH_before")
    assert row["bacc"] == pytest.approx(summary["iC"]["RRvsRH"]["bacc"], abs=1e-4)
    variance = row["tnr"] * (100 - row["tnr"]) / 40 + row["tpr"] * (100 - row["tpr"]) / 30
    assert row["bacc_se"] == pytest.approx(np.sqrt(variance) / 2)
    assert describe(out / "scores.parquet").columns["chance"].unit == "%"


def test_rates_follow_from_predictions(study):
    summary, out = study(takeover_uv=5.0)
    table = read_table(out / "predictions.parquet")
    table["right"] = (table["score"] > 0) == (table["label"] == 1)
    one = table[(table["scenario"] == "iC") & (table["problem"] == "RRvsRH")]
    by_fold = one.groupby(["repeat", "fold"])["right"].mean()
    assert 100 * by_fold.mean() == pytest.approx(summary["iC"]["RRvsRH"]["acc"], abs=1e-4)
    assert one.groupby(["repeat"])["epoch"].nunique().tolist() == [70, 70]
    row = read_table(out / "scores.parquet").set_index(["scenario", "problem"]).loc[("iC", "RRvsRH")]
    assert row["stays"] == pytest.approx(100 * (one["score"] <= 0).mean(), abs=1)
    assert row["stays_rule_acc"] == pytest.approx(100 * 40 / 70)


def test_predictions_carry_the_trials_keys(study):
    _, out = study()
    source = trial_table(COUNTS, np.random.default_rng(0))
    for row in read_table(out / "predictions.parquet").sample(30, random_state=0).to_dict("records"):
        trial = source.iloc[row["epoch"]]
        assert [row[k] for k in ("scenario", "block", "episode", "trial")] == [
            trial[k] for k in ("scenario", "block", "episode", "trial")
        ]
        assert row["label"] == (trial["condition_before"] in ("HR", "RH"))


def test_the_same_bytes_again(study):
    first = digests(study(replace(QUICK, permutations=9))[1])
    assert digests(study(replace(QUICK, permutations=9))[1]) == first


def test_the_seed_and_the_subject_decide_the_folds(study):
    def folds(config, unit):
        return read_table(study(config, unit=unit)[1] / "predictions.parquet")["epoch"].tolist()

    assert folds(QUICK, "s01") == folds(replace(QUICK, permutations=3), "s01")
    assert folds(QUICK, "s01") != folds(replace(QUICK, seed=1), "s01")
    assert folds(QUICK, "s01") != folds(QUICK, "s02")


def test_permutation_p_values(study):
    _, out = study(replace(QUICK, permutations=19), takeover_uv=12.0)
    scores = read_table(out / "scores.parquet").set_index(["scenario", "problem"])
    assert scores.loc[("iC", "RRvsRH"), "p"] == pytest.approx(1 / 20)
    assert scores["p"].between(1 / 20, 1).all()
    # What p tests is one repeat, which stands beside it; bacc is the mean over repeats with other folds.
    assert scores.loc[("iC", "RRvsRH"), "permutation_bacc"] > 70
    assert (scores["permutation_bacc"] != scores["bacc"]).all()


def test_too_few_trials_fall_back_and_say_so(study):
    summary, out = study(counts={"iC": {"HH": 9, "HR": 5, "RR": 7, "RH": 2}, "sC": {"HH": 4}})
    scores = read_table(out / "scores.parquet").set_index(["scenario", "problem"])
    assert scores.loc[("iC", "HHvsHR"), "n_folds"] == 5
    assert "5 instead of 10 folds" in scores.loc[("iC", "HHvsHR"), "note"]
    assert summary["iC"]["RRvsRH"] == {
        "tnr": None,
        "tpr": None,
        "acc": None,
        "bacc": None,
        "chance": pytest.approx(77.7778),
        "p": None,
        "n1": 7,
        "n2": 2,
        "decoder": "rlda",
        "classes": ["RR_before", "RH_before"],
    }
    assert summary["sC"]["RRvsRH"]["chance"] is None
    assert any("iC RRvsRH: not computed: the smaller class has 2 trials" in w for w in summary["warnings"])
    empty = scores["n_folds"] == 0
    assert scores.loc[empty, RATES].isna().all().all()
    assert scores.loc[empty, "note"].str.contains("not computed").all()
    json.dumps(summary, allow_nan=False)


def test_no_problem_at_all(study):
    summary, out = study(replace(QUICK, problems={}))
    assert summary == {"warnings": ["no decoding problems are configured: nothing was decoded"]}
    assert len(read_table(out / "scores.parquet")) == 0
    group = out.parent / "group"
    group.mkdir()
    assert decode.run_group(QUICK, Inputs.of("group", decode={"s01": out}), group).keys() <= {"warnings"}


def test_a_foreign_study(study):
    n = 60
    table = pd.DataFrame({"event": ["square", "rt"] * (n // 2), "subject": "demo"})
    table["block"] = table["episode"] = table["trial"] = table["prev_error"] = table["turn"] = None
    config = replace(
        QUICK,
        conditions={"square": "event == 'square'", "rt": "event == 'rt'"},
        problems={"square_rt": ("square", "rt")},
        split="",
    )
    summary, out = study(config, epochs=epochs_of(table))
    assert set(summary) == {"all"}
    assert 25 < summary["all"]["square_rt"]["bacc"] < 75
    assert read_table(out / "predictions.parquet")["block"].isna().all()
    assert "no such column" in read_table(out / "scores.parquet")["note"][0]


def test_several_decoders_are_compared_on_the_same_folds(study, tmp_path):
    mine = decode.Recipe("rlda", "windows", {"shrinkage": 0.2})
    config = replace(QUICK, decoders=("rlda", "rlda_600", "shrinkage_lda", "mine"), recipes={"mine": mine}, repeats=1)
    folders, summaries = {}, {}
    for unit in ("s01", "s02", "s03"):
        summaries[unit], folders[unit] = study(config, unit=unit, takeover_uv=6.0, seed=int(unit[1:]))
    predictions = read_table(folders["s01"] / "predictions.parquet")
    folds = predictions.pivot(index=["scenario", "problem", "epoch"], columns="decoder", values="fold")
    assert folds.nunique(axis=1).eq(1).all()
    out = tmp_path / "group"
    out.mkdir()
    group = decode.run_group(config, Inputs.of("group", decode=folders), out)
    for place, summary in ((folders["s01"] / "scores.parquet", summaries["s01"]), (out / "table2.parquet", group)):
        said = summary["iC"]["RRvsRH"]
        assert (said["decoder"], set(said["others"])) == ("rlda", {"rlda_600", "shrinkage_lda", "mine"})
        table = read_table(place)
        rows = table[(table["scenario"] == "iC") & (table["problem"] == "RRvsRH") & (table["decoder"] == "mine")]
        acc = rows["acc"] if "acc" in rows else rows.set_index("measure").loc[["acc"], "mean"]
        assert said["others"]["mine"]["acc"] == pytest.approx(acc.iloc[0], abs=1e-4)
        json.dumps(summary, allow_nan=False)
    compared = read_table(out / "compared.parquet")
    assert len(compared) == 4 * 3
    assert (compared["p_holm"] >= compared["p"]).all()
    assert (
        "too slow"
        in read_table(folders["s01"] / "scores.parquet").set_index("decoder")["note"]["shrinkage_lda"].iloc[0]
    )


def test_the_group(study, tmp_path):
    folders = {f"s{i:02d}": study(unit=f"s{i:02d}", takeover_uv=8.0, seed=i)[1] for i in range(1, 5)}
    out = tmp_path / "group"
    out.mkdir()
    summary = decode.run_group(QUICK, Inputs.of("group", decode=folders), out)
    table = read_table(out / "table2.parquet").set_index(["scenario", "problem", "measure"])
    row = table.loc[("iC", "RRvsRH", "acc")]
    assert (row["published_mean"], row["published_sd"], row["n"]) == (57.1, 3.7, 4)
    each = [
        read_table(f / "scores.parquet").set_index(["scenario", "problem"]).loc[("iC", "RRvsRH"), "acc"]
        for f in folders.values()
    ]
    assert row["mean"] == pytest.approx(np.mean(each))
    assert row["sd"] == pytest.approx(np.std(each, ddof=1))
    assert row["half_width"] == pytest.approx(t.ppf(0.975, 3) * np.std(each, ddof=1) / 2)
    tests = read_table(out / "group_tests.parquet").set_index(["scenario", "problem"])
    assert tests.loc[("iC", "RRvsRH"), "p"] == 1 / 16
    assert tests.loc[("iC", "RRvsRH"), "p_holm"] == pytest.approx(4 / 16)
    for rate in ("tnr", "tpr", "acc"):
        assert tests[f"published_{rate}"].tolist() == [False, True, False, False]
    scores = [read_table(f / "scores.parquet").set_index(["scenario", "problem"]) for f in folders.values()]
    beyond = np.array([one.loc[("iC", "RRvsRH"), "tpr"] - one.loc[("iC", "RRvsRH"), "chance"] for one in scores])
    signs = np.array(list(itertools.product([1, -1], repeat=4)))
    expected = np.mean(signs @ beyond >= beyond.sum() - 1e-9)
    assert tests.loc[("iC", "RRvsRH"), "p_tpr"] == pytest.approx(expected)
    assert summary["iC"]["RRvsRH"]["p_above_chance"]["tpr"] == pytest.approx(expected)
    assert summary["iC"]["RRvsRH"]["n"] == 4
    assert len(read_table(out / "subjects.parquet")) == 16
    assert {p.suffix for p in out.iterdir()} == {".parquet"}, "pictures are the drawings'"
    before = digests(out)
    decode.run_group(QUICK, Inputs.of("group", decode=folders), out)
    assert digests(out) == before


def test_the_group_leaves_out_what_was_not_computed(study, tmp_path):
    few = {"iC": {"HH": 9, "HR": 5, "RR": 7, "RH": 2}, "sC": {"HH": 30, "HR": 12, "RR": 24, "RH": 16}}
    folders = {"s01": study(unit="s01")[1], "s02": study(unit="s02", counts=few)[1]}
    out = tmp_path / "group"
    out.mkdir()
    summary = decode.run_group(QUICK, Inputs.of("group", decode=folders), out)
    assert summary["iC"]["RRvsRH"]["n"] == 1
    assert summary["warnings"] == ["not computed, so left out of the group: s02 iC RRvsRH"]
    json.dumps(summary, allow_nan=False)
    decode.run_group(QUICK, Inputs.of("group", decode={"s02": folders["s02"]}), out)
    tests = read_table(out / "group_tests.parquet").set_index(["scenario", "problem"])
    assert tests.loc[("iC", "RRvsRH"), "n"] == 0
    assert np.isnan(tests.loc[("iC", "RRvsRH"), ["p_tnr", "p_tpr", "p_acc"]].astype(float)).all()


def test_the_0_to_600_ms_mean_stands_beside_the_papers_by_default(study):
    assert decode.Config().decoders == ("rlda", "rlda_600")
    _, out = study(replace(QUICK, decoders=decode.Config().decoders, repeats=1))
    scores = read_table(out / "scores.parquet").groupby("decoder", observed=True)["bacc"].mean()
    assert scores["rlda"] != scores["rlda_600"]


@pytest.mark.parametrize(
    ("change", "error", "text"),
    [
        ({"split": "scenari"}, ConfigError, r"split = 'scenari' is no column .*did you mean 'scenario'"),
        (
            {"conditions": {**QUICK.conditions, "HH_before": "condition == 'HH'"}},
            ConfigError,
            "HH_before = .* evaluated",
        ),
        (
            {"conditions": {**QUICK.conditions, "HR_before": "trial"}},
            ConfigError,
            "HR_before = 'trial' gives int64 values",
        ),
        (
            {"conditions": {**QUICK.conditions, "HH_before": "condition_before in ['HH', 'HR']"}},
            ConfigError,
            "26 trials",
        ),
        ({"mean_window_s": (0.0, 1.5)}, DataError, "0-1.5 s reaches past the epoch"),
    ],
)
def test_poor_configuration_meets_the_data(study, change, error, text):
    with pytest.raises(error, match=text):
        study(replace(QUICK, **change))


def test_a_split_column_without_a_value_leaves_one_scenario(study):
    epochs = epochs_of(trial_table(COUNTS, np.random.default_rng(0)).assign(scenario=None))
    summary, _ = study(QUICK, epochs=epochs)
    assert list(summary) == ["all"]


def test_samples_that_are_not_finite_stop_the_stage(study):
    epochs = epochs_of(trial_table(COUNTS, np.random.default_rng(0)))
    epochs._data[100, 2, 5] = np.nan
    with pytest.raises(DataError, match="not finite") as caught:
        study(epochs=epochs)
    assert "acquire.bads" in caught.value.cure


def test_every_reason_for_which_trials_cannot_be_decoded_has_a_cure():
    reasons = {one for one in vars(refusals).values() if isinstance(one, type) and issubclass(one, ValueError)}
    assert reasons == set(decode._CURES)
    for reason, (error, cure) in decode._CURES.items():
        with pytest.raises(error, match="what is wrong") as caught, cured(decode._CURES):
            raise reason("what is wrong")
        assert caught.value.cure == cure != ""


def test_epochs_without_a_signal_have_a_cure(study):
    epochs = epochs_of(trial_table(COUNTS, np.random.default_rng(0)))
    epochs._data[:] = 0.0
    with pytest.raises(DataError, match="no signal") as caught:
        study(epochs=epochs)
    assert "look at quality.png of preprocess" in caught.value.cure


def test_a_rate_too_low_for_the_windows_has_a_cure(study):
    with pytest.raises(DataError, match="holds no sample") as caught:
        study(epochs=epochs_of(trial_table(COUNTS, np.random.default_rng(0)), sfreq=15.0))
    assert caught.value.cure == "use a higher sampling rate"


def test_a_missing_library_and_wrong_parameters_have_a_cure(study, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyriemann", None)
    monkeypatch.setitem(sys.modules, "pyriemann.estimation", None)
    with pytest.raises(ConfigError, match="needs the library pyriemann") as caught:
        study(replace(QUICK, decoders=("xdawn_tangent",)))
    assert "pip install pyriemann" in caught.value.cure
    odd = decode.Recipe("shrinkage_lda", params={"gamma": 2})
    with pytest.raises(ConfigError, match="do not fit") as caught:
        decode.run(replace(QUICK, decoders=("odd",), recipes={"odd": odd}), *written(study))
    assert caught.value.cure == "correct [decode.recipes]"


def test_check_names_every_contradiction():
    bad = replace(
        QUICK,
        decoders=("rlda", "toeplitz", "rlda"),
        mean_window_s=(0.8, 0.0),
        recipes={
            "steep": decode.Recipe("rlda", params={"shrinkage": 1.5}),
            "flat": decode.Recipe("rlda", "epochs"),
            "auto": decode.Recipe("shrinkage_lda", params={"shrinkage": 0.5}),
            "uneven": decode.Recipe("toeplitz_lda", "windows", {"n_times": 15}),
            "unsaid": decode.Recipe("toeplitz_lda", "steps"),
            "rows": decode.Recipe("xdawn_tangent", "windows"),
            "none": decode.Recipe("xdawn_tangent", "epochs", {"n_filters": 0}),
            "half": decode.Recipe("xdawn_tangent", "epochs", {"n_filters": 2.5}),
        },
    )
    text = "\n".join(decode.check(bad))
    for part in (
        "'toeplitz' (did you mean 'toeplitz_lda'?)",
        "only once",
        "start first",
        "recipes.steep.params = {'shrinkage': 1.5}; allowed for rlda: 0 < shrinkage <= 1",
        "recipes.flat.features = 'epochs'; allowed for rlda: windows, windows_600, steps, windows_bands",
        "recipes.auto.params = {'shrinkage': 0.5}; allowed for shrinkage_lda: none",
        "recipes.uneven.features = 'windows'; allowed for toeplitz_lda: steps",
        "recipes.uneven.params = {'n_times': 15}; allowed for toeplitz_lda: n_times = 12, and it must be given",
        "recipes.unsaid.params = {}; allowed for toeplitz_lda: n_times = 12",
        "recipes.rows.features = 'windows'; allowed for xdawn_tangent: epochs",
        "recipes.none.params = {'n_filters': 0}; allowed for xdawn_tangent: a whole n_filters >= 1",
        "recipes.half.params = {'n_filters': 2.5}",
    ):
        assert part in text
    assert decode.check(decode.Config(recipes=BUILTIN)) == []


def test_the_recipes_in_configs_are_the_built_in_ones():
    folder = Path(__file__).parents[2] / "configs" / "decoders"
    found = {}
    for path in sorted(folder.glob("*.toml")):
        found |= tomllib.loads(path.read_text())["decode"]["recipes"]
    assert {name: decode.Recipe(**values) for name, values in found.items()} == BUILTIN


@pytest.mark.parametrize("gap_s", [0.0, 0.02])
def test_noise_with_every_trial_twice_decodes_as_noise_with_each_once(study, gap_s):
    counts = {"iC": {"RR": 40, "RH": 40}}
    once = trial_table(counts, np.random.default_rng(0)).assign(onset_s=lambda t: 2.0 * np.arange(len(t)))
    epochs = epochs_of(once)
    copies = once.assign(onset_s=once["onset_s"] + gap_s)
    twice = mne.concatenate_epochs([epochs, epochs.copy()], add_offset=True, verbose="error")
    twice.metadata = pd.concat([once, copies], ignore_index=True)
    config = replace(QUICK, permutations=9)
    plain, _ = study(config, epochs=epochs, unit="s01")
    doubled, out = study(config, epochs=twice, unit="s01")
    assert doubled["iC"] == plain["iC"]
    assert read_table(out / "scores.parquet")["n1"].max() <= 40
    assert any("begin less than 0.1 s after another trial" in warning for warning in doubled["warnings"])
