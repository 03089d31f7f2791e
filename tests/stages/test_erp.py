import dataclasses
import json
from pathlib import Path

import mne
import numpy as np
import pandas as pd
import pytest
from epoch_factory import CHANNELS, trial_table, write_subject
from overlapping import overlapping

from hrcneuro.contract import Inputs
from hrcneuro.eeg.evoked import subtract_baseline, within
from hrcneuro.eeg.resample import ratio
from hrcneuro.errors import ConfigError, DataError
from hrcneuro.io.fif import read_evokeds, write_epochs
from hrcneuro.io.tables import describe, read_lists, read_table, write_table
from hrcneuro.stages import erp
from hrcneuro.tables.quality import TIMING

pytestmark = pytest.mark.filterwarnings("ignore:The inplace keyword")

SAMPLE = Path(__file__).parents[3] / "shared/data/eeglab_sample/eeglab_data.set"
FOREIGN = erp.Config(conditions={"square": "event == 'square'", "rt": "event == 'rt'"}, contrasts={}, split="")
SMALL = erp.Config(contrasts={"RH-RR_before": ("RH_before", "RR_before")})


def run(folder, config=SMALL, unit="s01", **options):
    """Write one subject's epochs, run erp on them; return the summary, the output folder and the epochs."""
    epochs = write_subject(folder / "epoch" / unit, unit, **({"seed": 1} | options))
    out = folder / "erp" / unit
    out.mkdir(parents=True)
    return erp.run(config, Inputs.of(unit, epoch=folder / "epoch" / unit), out), out, epochs


def run_group(folder, n_subjects, config=SMALL, **options):
    """Run several subjects and the group; return the group's summary and folder."""
    units = {}
    for i in range(n_subjects):
        unit = f"s{i + 1:02d}"
        units[unit] = run(folder, config, unit, **(options | {"seed": i}))[1]
    out = folder / "erp" / "group"
    out.mkdir()
    return erp.run_group(config, Inputs.of("group", erp=units), out), out


def row(path, **keys):
    """Return the index of the only row of a table with these values."""
    table = read_table(path)
    mask = np.logical_and.reduce([table[name] == value for name, value in keys.items()])
    assert mask.sum() == 1
    return int(np.flatnonzero(mask)[0])


def test_evokeds_are_the_means_of_baseline_corrected_trials(tmp_path):
    summary, out, epochs = run(tmp_path, erp.Config())
    evokeds = {e.comment: e for e in read_evokeds(out / "s01_ave.fif")}
    trials = epochs.metadata.reset_index(drop=True)
    data = subtract_baseline(epochs.get_data(copy=True), epochs.times, (-0.2, 0.0))
    for comment, mask in {
        "all/RH_before": trials["condition_before"] == "RH",
        "sC/HH_after": (trials["condition_after"] == "HH") & (trials["scenario"] == "sC"),
        "iC/RR_after_ok": (trials["condition_after"] == "RR") & ~trials["error"] & (trials["scenario"] == "iC"),
    }.items():
        mask = mask.to_numpy(bool)
        scenario, condition = comment.split("/")
        assert evokeds[comment].nave == mask.sum() == summary["trials"][scenario][condition]
        np.testing.assert_allclose(
            evokeds[comment].data, data[mask].mean(axis=0), atol=1e-11
        )  # single precision on disk
    missing = summary["warnings"][0].count("/") if summary["warnings"] else 0
    assert len(evokeds) + missing == 3 * 12
    assert evokeds["all/RH_before"].times[0] == pytest.approx(epochs.times[0])
    assert evokeds["all/RH_before"].baseline is not None


def test_averages_table_tells_trials_and_gaps(tmp_path):
    _, out, epochs = run(tmp_path)
    table = read_table(out / "averages.parquet")
    trials = epochs.metadata
    one = table[(table["scenario"] == "all") & (table["condition"] == "RH_before")].iloc[0]
    chosen = trials[trials["condition_before"] == "RH"]
    assert one["n"] == len(chosen)
    assert one["gap_s"] == chosen["soa_s"].min()


def test_waveforms_hold_means_and_standard_errors_of_all_trials(tmp_path):
    _, out, epochs = run(tmp_path)
    table = read_table(out / "waveforms.parquet")
    assert set(table["channel"]) == set(CHANNELS)
    data = subtract_baseline(epochs.get_data(copy=True) * 1e6, epochs.times, (-0.2, 0.0))
    mask = (epochs.metadata["condition_before"] == "RH").to_numpy()
    at = row(out / "waveforms.parquet", condition="RH_before", channel="C3")
    assert table["n"][at] == mask.sum()
    assert table["gap_s"][at] == epochs.metadata["soa_s"][mask].min()
    waves = data[mask][:, CHANNELS.index("C3")]
    error = waves.std(axis=0, ddof=1) / np.sqrt(len(waves))
    np.testing.assert_allclose(read_lists(out / "waveforms.parquet", "mean_uv")[at], waves.mean(axis=0), atol=1e-4)
    np.testing.assert_allclose(read_lists(out / "waveforms.parquet", "error_uv")[at], error, rtol=1e-4, atol=1e-5)


def test_an_empty_condition_is_left_out_and_named(tmp_path):
    table = trial_table(np.random.default_rng(0), 40)
    table.loc[table["scenario"] == "iC", "condition_before"] = "HH"
    summary, out, _ = run(tmp_path, table=table)
    assert "iC/RH_before" in summary["warnings"][0]
    assert "iC/RH_before" not in {e.comment for e in read_evokeds(out / "s01_ave.fif")}
    averages = read_table(out / "averages.parquet")
    assert "iC/RH_before" not in set(averages["scenario"].astype(str) + "/" + averages["condition"].astype(str))
    assert averages["n"].min() > 0
    assert "a condition without a trial has no row" in describe(out / "averages.parquet").row
    assert "RH_before" not in summary["trials"]["iC"]


def test_no_condition_with_trials_names_the_events(tmp_path):
    with pytest.raises(DataError, match="none of the 60 epochs") as caught:
        run(tmp_path, erp.Config(conditions={"x": "event == 'x'"}, contrasts={}))
    assert "move" in caught.value.cure


def test_a_foreign_study_runs_without_scenarios_gaps_or_contrasts(tmp_path):
    table = pd.DataFrame({"event": ["square", "rt"] * 15, "scenario": None, "condition_before": None, "soa_s": np.nan})
    summary, out, _ = run(tmp_path, FOREIGN, "demo", table=table, channels=("E1", "E2", "Oz"))
    assert summary["trials"] == {"all": {"square": 15, "rt": 15}}
    assert summary["shortest_gap_s"] is None
    assert summary["warnings"] == []
    assert read_table(out / "channels.parquet")["x_m"].notna().sum() == 1
    json.dumps(summary, allow_nan=False)


def test_the_same_input_gives_the_same_bytes(tmp_path):
    outs = [run_group(tmp_path / name, 1)[1] for name in ("a", "b")]
    for folder in ("group", "s01"):
        first, second = (out.parent / folder for out in outs)
        assert {p.name for p in first.iterdir()} == {p.name for p in second.iterdir()}
        for path in first.iterdir():
            assert path.read_bytes() == (second / path.name).read_bytes(), path.name


def test_group_means_and_statistics(tmp_path):
    summary, out = run_group(tmp_path, 7, effect_uv=12, n=120)
    tables = {"erp.parquet", "erp_stats.parquet", "erp_strata.parquet", "channels.parquet"}
    assert {p.name for p in out.iterdir()} == tables
    evokeds = [
        {e.comment: e.data * 1e6 for e in read_evokeds(tmp_path / f"erp/s{i:02d}/s{i:02d}_ave.fif")}
        for i in range(1, 8)
    ]
    at = row(out / "erp.parquet", scenario="iC", condition="RH_before", channel="Cz")
    waves = np.stack([e["iC/RH_before"][CHANNELS.index("Cz")] for e in evokeds])
    np.testing.assert_allclose(read_lists(out / "erp.parquet", "mean_uv")[at], waves.mean(axis=0), atol=1e-4)
    np.testing.assert_allclose(read_lists(out / "erp.parquet", "sd_uv")[at], waves.std(axis=0, ddof=1), atol=1e-4)

    stats = out / "erp_stats.parquet"
    at = row(stats, scenario="all", contrast="RH-RR_before", channel="Fz")
    difference = np.stack([e["all/RH_before"] - e["all/RR_before"] for e in evokeds])[:, 0]
    np.testing.assert_allclose(read_lists(stats, "difference_uv")[at], difference.mean(axis=0), atol=1e-4)
    t = difference.mean(axis=0) / difference.std(axis=0, ddof=1) * np.sqrt(7)
    np.testing.assert_allclose(read_lists(stats, "t")[at], t, rtol=1e-3, atol=1e-4)
    table = read_table(stats)
    times = table["start_s"][at] + table["step_s"][at] * np.arange(len(t))
    assert times[np.argmin(np.abs(times))] == pytest.approx(0, abs=1e-9)
    significant = read_lists(stats, "significant")[at]
    assert significant[np.abs(times - 0.5) < 0.02].any()
    assert not significant[np.abs(times - 0.5) > 0.3].any()
    low, dz, high = (read_lists(stats, name)[at] for name in ("dz_low", "dz", "dz_high"))
    assert (low < dz).all()
    assert (dz < high).all()

    found = summary["contrasts"]["all"]["RH-RR_before"]
    assert found["n"] == 7
    assert found["flips"] == 128
    assert found["significant"] == int(read_lists(stats, "significant")[table["scenario"] == "all"].sum()) > 0
    assert found["peak"]["channel"] == "Fz"
    assert found["peak"]["time_s"] == pytest.approx(0.5, abs=0.05)
    assert found["t_low"] == -found["t_high"]
    peak = found["peak"]
    at = row(stats, scenario="all", contrast="RH-RR_before", channel=peak["channel"])
    sample = np.argmin(np.abs(times - peak["time_s"]))
    for name in ("dz_low", "dz", "dz_high"):
        assert peak[name] == pytest.approx(read_lists(stats, name)[at][sample], rel=1e-5)
    assert 0 < peak["dz_low"] < peak["dz"] < peak["dz_high"]
    assert not summary["warnings"]
    json.dumps(summary, allow_nan=False)


def test_contrasts_are_tested_again_within_strata(tmp_path):
    """An effect of the previous error alone is a difference of conditions, but within neither stratum."""
    units, config = {}, dataclasses.replace(SMALL, min_stratum=3)
    for i in range(7):
        rng = np.random.default_rng(i)
        table = trial_table(rng, 240)
        takeover = (table["condition_before"] == "RH").to_numpy()
        table["prev_error"] = rng.random(240) < np.where(takeover, 0.7, 0.25)
        folder = tmp_path / "epoch" / f"s{i}"
        epochs = write_subject(folder, f"s{i}", seed=i, table=table)
        bump = 40e-6 * np.exp(-(((epochs.times - 0.5) / 0.06) ** 2))
        epochs._data[table["prev_error"].to_numpy(), 0] += bump
        write_epochs(epochs, folder / f"s{i}_epo.fif")
        out = tmp_path / "erp" / f"s{i}"
        out.mkdir(parents=True)
        summary = erp.run(config, Inputs.of(f"s{i}", epoch=folder), out)
        assert not summary["warnings"]
        units[f"s{i}"] = out
        mask = takeover & table["prev_error"].to_numpy() & (table["scenario"] == "iC").to_numpy()
        found = {e.comment: e for e in read_evokeds(out / f"s{i}_strata_ave.fif")}["iC, prev_error yes/RH_before"]
        assert found.nave == mask.sum()
        baselined = subtract_baseline(epochs.get_data(copy=True)[mask] * 1e6, epochs.times, (-0.2, 0))
        np.testing.assert_allclose(found.data * 1e6, baselined.mean(axis=0), atol=1e-4)
        counted = read_table(out / "strata.parquet").set_index(["stratum", "scenario", "condition"])
        assert counted.loc[("prev_error yes", "iC", "RH_before"), "n"] == mask.sum()

    out = tmp_path / "group"
    out.mkdir()
    summary = erp.run_group(config, Inputs.of("group", erp=units), out)
    assert summary["contrasts"]["all"]["RH-RR_before"]["significant"] > 0
    names = {f"{s}, {c} {v}" for s in ("iC", "sC") for c in ("prev_error", "turn") for v in ("no", "yes")}
    assert set(summary["strata"]) == names
    table = read_table(out / "erp_strata.parquet")
    assert set(table["stratum"]) == {"prev_error no", "prev_error yes", "turn no", "turn yes"}

    def at_the_effect(path, **keys):
        mine = row(path, scenario="iC", contrast="RH-RR_before", channel="Fz", **keys)
        return read_lists(path, "difference_uv")[mine][np.argmin(np.abs(epochs.times - 0.5))]

    plain = at_the_effect(out / "erp_stats.parquet")
    assert plain > 10
    for stratum in ("prev_error no", "prev_error yes"):
        assert abs(at_the_effect(out / "erp_strata.parquet", stratum=stratum)) < 0.25 * plain
    for stratum in ("turn no", "turn yes"):
        assert at_the_effect(out / "erp_strata.parquet", stratum=stratum) > 0.5 * plain
    assert set(table["scenario"]) == {"iC", "sC"}
    json.dumps(summary, allow_nan=False)


@pytest.mark.parametrize("change", [{"strata": ()}, {"stratified": ("*_after",)}, {"min_stratum": 1000}])
def test_without_strata_there_are_none(tmp_path, change):
    summary, out = run_group(tmp_path, 2, dataclasses.replace(SMALL, **change))
    assert summary["strata"] == {}
    assert not len(read_table(out / "erp_strata.parquet"))


def test_a_stratum_that_the_trials_lack_is_said(tmp_path):
    summary, *_ = run(tmp_path, dataclasses.replace(SMALL, strata=("prev_error", "mood")))
    assert summary["warnings"] == ["no strata of mood: no such column, or no value in it"]


def test_three_subjects_are_warned_of_and_one_is_described(tmp_path):
    summary, _ = run_group(tmp_path / "three", 3, effect_uv=30)
    assert "with 3 subjects the smallest p is 0.25" in summary["warnings"][0]
    assert summary["contrasts"]["all"]["RH-RR_before"]["significant"] == 0
    assert summary["contrasts"]["all"]["RH-RR_before"]["t_high"] is None

    summary, out = run_group(tmp_path / "one", 1)
    assert "one subject cannot be tested" in summary["warnings"][0]
    stats = out / "erp_stats.parquet"
    assert (read_lists(stats, "p") == 1).all()
    assert np.isnan(read_lists(stats, "t").astype(float)).all()
    assert np.isfinite(read_lists(stats, "difference_uv")).all()
    json.dumps(summary, allow_nan=False)


def test_a_subject_without_a_condition_leaves_only_its_contrasts(tmp_path):
    units = {}
    for i in range(6):
        table = trial_table(np.random.default_rng(i), 50)
        if i == 2:
            table.loc[(table["scenario"] == "iC") & (table["condition_before"] == "RH"), "condition_before"] = "HH"
        units[f"s{i}"] = run(tmp_path, unit=f"s{i}", table=table)[1]
    out = tmp_path / "group"
    out.mkdir()
    summary = erp.run_group(SMALL, Inputs.of("group", erp=units), out)
    assert summary["contrasts"]["iC"]["RH-RR_before"]["n"] == 5
    assert summary["contrasts"]["sC"]["RH-RR_before"]["n"] == 6
    stats = out / "erp_stats.parquet"
    at = row(stats, scenario="iC", contrast="RH-RR_before", channel="Cz")
    assert tuple(read_table(stats).loc[at, ["plus", "minus", "n", "subjects"]]) == ("RH_before", "RR_before", 5, 6)
    own = np.stack(
        [
            1e6 * e.data[CHANNELS.index("Cz")]
            for unit, folder in units.items()
            for e in read_evokeds(folder / f"{unit}_ave.fif")
            if unit != "s2" and e.comment == "iC/RR_before"
        ]
    )
    np.testing.assert_allclose(read_lists(stats, "minus_uv")[at], own.mean(axis=0), atol=1e-4)
    error = own.std(axis=0, ddof=1) / np.sqrt(5)
    np.testing.assert_allclose(read_lists(stats, "minus_error_uv")[at], error, rtol=1e-4, atol=1e-5)
    assert any("iC, RH-RR_before: without s2" in w for w in summary["warnings"])


def test_a_contrast_that_nobody_has_is_named(tmp_path):
    config = dataclasses.replace(SMALL, contrasts={**SMALL.contrasts, "x": ("none", "RH_before")})
    config = dataclasses.replace(config, conditions={**config.conditions, "none": "event == 'none'"})
    summary, _ = run_group(tmp_path, 2, config)
    assert "no subject has both conditions of x" in summary["warnings"]


def test_a_group_without_contrasts_has_empty_statistics(tmp_path):
    config = dataclasses.replace(SMALL, contrasts={})
    summary, out = run_group(tmp_path, 2, config)
    assert summary["contrasts"] == {}
    assert len(read_table(out / "erp_stats.parquet")) == 0


def test_cluster_correction(tmp_path, capsys):
    config = dataclasses.replace(SMALL, correction="cluster")
    summary, out = run_group(tmp_path, 6, config, effect_uv=12, sfreq=64.0, n=120)
    assert capsys.readouterr().out == ""
    assert summary["correction"] == "cluster"
    assert summary["contrasts"]["all"]["RH-RR_before"]["significant"] > 0
    assert describe(out / "erp_stats.parquet").columns["p"].text.startswith("two-sided p corrected")


def test_cluster_correction_needs_positions(tmp_path):
    config = dataclasses.replace(SMALL, correction="cluster")
    with pytest.raises(ConfigError, match="unknown: E1"):
        run_group(tmp_path, 2, config, channels=("Fz", "Cz", "Pz", "C3", "E1"))


def test_subjects_with_different_epochs_are_refused(tmp_path):
    units = {unit: run(tmp_path, unit=unit, sfreq=f)[1] for unit, f in (("s01", 128.0), ("s02", 64.0))}
    with pytest.raises(DataError, match=r"s01 has 181 samples .* s02 91"):
        erp.run_group(SMALL, Inputs.of("group", erp=units), tmp_path)


@pytest.mark.parametrize(("sources", "told"), [((511.9, 999.7), "= 511,"), ((500.0, 1000.0), "= 500,")])
def test_unequal_rates_name_the_recordings_and_a_rate_that_all_reach(tmp_path, sources, told):
    units, timing = {}, {}
    for unit, source in zip(("s01", "s02"), sources, strict=True):
        made = ratio(source, 512)
        units[unit] = run(tmp_path, unit=unit, sfreq=made.sfreq)[1]
        timing[unit] = tmp_path / "preprocess" / unit
        timing[unit].mkdir(parents=True)
        row = {"source_sfreq": source, "sfreq": made.sfreq, "up": made.up, "down": made.down}
        write_table(pd.DataFrame([row | {"n_source": 1, "n_samples": 1}]), timing[unit] / "timing.parquet", TIMING)
    with pytest.raises(DataError, match=f"s01 was recorded at {sources[0]:g} Hz and is at") as caught:
        erp.run_group(SMALL, Inputs.of("group", erp=units, preprocess=timing), tmp_path)
    assert f"preprocess.sfreq {told}" in caught.value.cure


def test_channels_that_not_all_have_are_left_out(tmp_path):
    units = {u: run(tmp_path, unit=u, channels=c)[1] for u, c in (("s01", CHANNELS), ("s02", CHANNELS[2:]))}
    out = tmp_path / "group"
    out.mkdir()
    summary = erp.run_group(SMALL, Inputs.of("group", erp=units), out)
    assert list(read_table(out / "erp.parquet")["channel"].unique()) == list(CHANNELS[2:])
    assert summary["warnings"][0] == "the group has 6 of 8 channels, those of all: s02 lacks Fz, FC1"


def test_subjects_without_a_common_channel_are_refused(tmp_path):
    units = {u: run(tmp_path, unit=u, channels=c)[1] for u, c in (("s01", CHANNELS[:3]), ("s02", CHANNELS[3:]))}
    with pytest.raises(DataError, match=r"no EEG channel in common.* s01 has Fz, FC1, FC2; s02 has C3, Cz") as caught:
        erp.run_group(SMALL, Inputs.of("group", erp=units), tmp_path)
    assert "acquire.channel_map" in caught.value.cure


def test_overlap_of_all_moves_is_regressed_out(tmp_path):
    """Without noise, nothing but rounding remains beside the response of all moves, with an epoch or without."""
    response, times = overlapping(tmp_path)
    expected = response - response[within(times, -0.2, 0)].mean()
    inputs = Inputs.of("s01", **{name: tmp_path / name for name in ("acquire", "preprocess", "epoch")})
    found = {}
    for overlap in ("keep", "regress"):
        out = tmp_path / overlap
        out.mkdir()
        found[overlap] = (
            erp.run(dataclasses.replace(SMALL, overlap=overlap), inputs, out),
            {e.comment: 1e6 * e.data for e in read_evokeds(out / "s01_ave.fif")},
        )
    (kept, plain), (regressed, free) = found["keep"], found["regress"]
    assert kept["trials"] == regressed["trials"]
    assert np.isnan(read_lists(tmp_path / "regress" / "waveforms.parquet", "error_uv")).all()
    assert np.abs(plain["all/RH_before"][0] - plain["all/RR_before"][0]).max() > 1
    for name in ("HH_before", "HR_before", "RR_before", "RH_before"):
        np.testing.assert_allclose(free[f"all/{name}"], [expected, 2 * expected], atol=1e-3)


def test_values_that_are_not_finite_are_refused(tmp_path):
    epochs = write_subject(tmp_path, "s01", seed=1)
    epochs._data[3, 2, 5] = np.nan
    write_epochs(epochs, tmp_path / "s01_epo.fif")
    with pytest.raises(DataError, match=f"epoch 3 holds values that are not finite on channel {CHANNELS[2]}"):
        erp.run(SMALL, Inputs.of("s01", epoch=tmp_path), tmp_path)


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"baseline_s": (0.0, -0.2)}, "baseline_s = [0.0, -0.2]"),
        ({"map_times_s": (0.1, 0.2, 0.3, 0.4, 0.5)}, "map_times_s has 5 times"),
    ],
)
def test_contradictions_are_found(changes, told):
    assert any(told in sentence for sentence in erp.check(dataclasses.replace(erp.Config(), **changes)))
    assert erp.check(erp.Config()) == []


def test_a_baseline_outside_the_epochs_is_refused(tmp_path):
    with pytest.raises(ConfigError, match=r"baseline -1…-0\.5 s"):
        run(tmp_path, dataclasses.replace(SMALL, baseline_s=(-1.0, -0.5)))


@pytest.mark.skipif(not SAMPLE.is_file(), reason="EEGLAB's sample recording is not there")
def test_the_sample_recording_shows_a_visual_response(tmp_path):
    raw = mne.io.read_raw_eeglab(SAMPLE, preload=True, verbose="error").filter(1, 40, verbose="error")
    raw.drop_channels(["EOG1", "EOG2"]).set_eeg_reference("average", verbose="error")
    events, codes = mne.events_from_annotations(raw, verbose="error")
    squares = events[events[:, 2] == codes["square"]]
    epochs = mne.Epochs(raw, squares, tmin=-0.2, tmax=1.0, baseline=None, preload=True, verbose="error")
    epochs.metadata = pd.DataFrame({"event": ["square"] * len(epochs), "scenario": None, "soa_s": np.nan})
    (tmp_path / "epoch").mkdir()
    (tmp_path / "erp").mkdir()
    write_epochs(epochs, tmp_path / "epoch" / "demo_epo.fif")
    config = dataclasses.replace(FOREIGN, channel="Oz")
    summary = erp.run(config, Inputs.of("demo", epoch=tmp_path / "epoch"), tmp_path / "erp")
    assert summary["trials"]["all"] == {"square": 80}
    evoked = read_evokeds(tmp_path / "erp" / "demo_ave.fif")[0]
    times, wave = evoked.times, evoked.data[evoked.ch_names.index("Oz")] * 1e6
    noise = wave[times < 0].std()
    early, late = (times > 0.12) & (times < 0.2), (times > 0.3) & (times < 0.45)
    assert wave[early].max() > 1.5 * noise  # P1 over the visual cortex
    assert wave[late].min() < -5 * noise
