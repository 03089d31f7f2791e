import dataclasses
import json

import numpy as np
import pandas as pd
import pytest
from epoch_factory import CHANNELS, write_subject

from hrcneuro.contract import Inputs
from hrcneuro.eeg.morlet import Wavelets, linear_cycles, magnitudes
from hrcneuro.errors import ConfigError, DataError
from hrcneuro.io.tables import read_lists, read_table
from hrcneuro.stages import ersp

pytestmark = pytest.mark.filterwarnings("ignore:The inplace keyword")

SMALL = ersp.Config(contrasts={"RH-RR_before": ("RH_before", "RR_before")}, high_hz=16.0, channels=("Fz", "Cz"))


def run(folder, config=SMALL, unit="s01", **options):
    """Write one subject's epochs, run ersp on them; return the summary, the output folder and the epochs."""
    epochs = write_subject(folder / "epoch" / unit, unit, **({"seed": 1, "sfreq": 64.0} | options))
    out = folder / "ersp" / unit
    out.mkdir(parents=True)
    return ersp.run(config, Inputs.of(unit, epoch=folder / "epoch" / unit), out), out, epochs


def run_group(folder, n_subjects, config=SMALL, **options):
    """Run several subjects and the group; return the group's summary and folder."""
    units = {}
    for i in range(n_subjects):
        unit = f"s{i + 1:02d}"
        units[unit] = run(folder, config, unit, **(options | {"seed": i}))[1]
    out = folder / "ersp" / "group"
    out.mkdir()
    return ersp.run_group(config, Inputs.of("group", ersp=units), out), out


def chosen(path, **keys):
    """Return which rows of a table have these values."""
    table = read_table(path)
    return np.logical_and.reduce([table[name] == value for name, value in keys.items()])


def test_rows_are_the_means_of_single_trial_magnitudes(tmp_path):
    config = dataclasses.replace(ersp.Config(), contrasts={})
    summary, out, epochs = run(tmp_path, config, sfreq=128.0)
    frequencies = tuple(np.arange(2.0, 31.0, 2.0))
    assert summary["frequencies_hz"] == list(frequencies)
    wavelets = Wavelets(frequencies, linear_cycles(frequencies, first=2, last=10), 128.0)
    mask = (epochs.metadata["condition_before"] == "HH").to_numpy()
    expected = magnitudes(epochs.get_data(copy=True)[mask] * 1e6, wavelets, step=2).mean(axis=0)
    rows = chosen(out / "ersp.parquet", scenario="all", condition="HH_before")
    found = read_lists(out / "ersp.parquet", "magnitude_uv")[rows].reshape(expected.shape)
    np.testing.assert_allclose(found, expected, rtol=1e-4)

    table = read_table(out / "ersp.parquet")[rows]
    assert list(table["channel"].unique()) == list(CHANNELS)
    assert set(table["n"]) == {int(mask.sum())} == {summary["trials"]["all"]["HH_before"]}
    assert table["start_s"].iloc[0] == pytest.approx(epochs.times[0])
    assert table["step_s"].iloc[0] == pytest.approx(2 / 128)
    assert set(table["gap_s"]) == {epochs.metadata["soa_s"][mask].min()}
    json.dumps(summary, allow_nan=False)


def test_group_statistics_find_the_planted_effect(tmp_path):
    summary, out = run_group(tmp_path, 8, effect_uv=25, n=100)
    tables = {"ersp.parquet", "ersp_stats.parquet", "ersp_strata.parquet"}
    assert {p.name for p in out.iterdir()} == tables
    stats = out / "ersp_stats.parquet"
    table = read_table(stats)
    rows = ((table["scenario"] == "all") & (table["channel"] == "Fz") & (table["frequency_hz"] == 4)).to_numpy()
    significant = read_lists(stats, "significant")[rows][0]
    times = table["start_s"][rows].iloc[0] + table["step_s"][rows].iloc[0] * np.arange(len(significant))
    assert significant[np.abs(times - 0.5) < 0.05].all()
    found = summary["contrasts"]["all"]["RH-RR_before"]
    assert found["significant"] > 0
    assert found["peak"]["channel"] == "Fz"
    assert found["peak"]["time_s"] == pytest.approx(0.5, abs=0.1)
    assert found["peak"]["difference_uv"] > 0
    assert summary["warnings"] == []
    assert summary["strata"]["iC, prev_error no"]["RH-RR_before"]["peak"]["channel"] == "Fz"
    json.dumps(summary, allow_nan=False)


def test_group_means_are_over_subjects(tmp_path):
    _, out = run_group(tmp_path, 3)
    keys = dict(scenario="sC", condition="RR_before", channel="Cz", frequency_hz=8.0)
    each = []
    for i in range(1, 4):
        path = tmp_path / f"ersp/s{i:02d}/ersp.parquet"
        each.append(read_lists(path, "magnitude_uv")[chosen(path, **keys)][0])
    rows = chosen(out / "ersp.parquet", **keys)
    np.testing.assert_allclose(read_lists(out / "ersp.parquet", "mean_uv")[rows][0], np.mean(each, axis=0), rtol=1e-5)
    np.testing.assert_allclose(
        read_lists(out / "ersp.parquet", "sd_uv")[rows][0], np.std(each, axis=0, ddof=1), rtol=1e-4
    )


def test_three_subjects_and_one(tmp_path):
    summary, _ = run_group(tmp_path / "three", 3)
    assert "with 3 subjects the smallest p is 0.25" in summary["warnings"][0]
    summary, out = run_group(tmp_path / "one", 1)
    assert "one subject cannot be tested" in summary["warnings"][0]
    assert not read_lists(out / "ersp_stats.parquet", "significant").any()


def test_cluster_correction(tmp_path):
    config = dataclasses.replace(SMALL, correction="cluster", high_hz=8.0, decimate=4)
    summary, _ = run_group(tmp_path, 6, config, effect_uv=25, n=80)
    assert summary["contrasts"]["all"]["RH-RR_before"]["significant"] > 0


def test_the_same_input_gives_the_same_bytes(tmp_path):
    outs = [run_group(tmp_path / name, 1)[1] for name in ("a", "b")]
    for folder in ("group", "s01"):
        first, second = (out.parent / folder for out in outs)
        for path in first.iterdir():
            assert path.read_bytes() == (second / path.name).read_bytes(), path.name


def test_a_foreign_study_runs(tmp_path):
    table = pd.DataFrame({"event": ["square", "rt"] * 12, "scenario": None, "soa_s": np.nan})
    config = dataclasses.replace(SMALL, conditions={"square": "event == 'square'"}, contrasts={}, split="")
    summary, out, _ = run(tmp_path, config, "demo", table=table, channels=("E1", "E2"))
    assert summary["trials"] == {"all": {"square": 12}}
    assert summary["warnings"] == []
    assert set(read_table(out / "ersp.parquet")["scenario"]) == {"all"}
    assert read_table(out / "channels.parquet")["x_m"].isna().all()
    group = tmp_path / "group"
    group.mkdir()
    summary = ersp.run_group(config, Inputs.of("group", ersp={"demo": out}), group)
    assert summary["contrasts"] == {}
    assert {p.name for p in group.iterdir()} == {"ersp.parquet", "ersp_stats.parquet", "ersp_strata.parquet"}


def test_frequencies_above_nyquist_are_refused(tmp_path):
    with pytest.raises(ConfigError, match=r"2…40 Hz; at 64 Hz they must lie in 0…32"):
        run(tmp_path, dataclasses.replace(SMALL, high_hz=40.0))


def test_an_incomplete_table_is_refused(tmp_path):
    _, out, _ = run(tmp_path)
    from hrcneuro.io.tables import write_table
    from hrcneuro.tables.contrasts import ERSP_SUBJECT

    table = read_table(out / "ersp.parquet").iloc[:-1]
    write_table(table, out / "ersp.parquet", ERSP_SUBJECT)
    with pytest.raises(DataError, match="not complete"):
        ersp.run_group(SMALL, Inputs.of("group", ersp={"s01": out}), tmp_path)


def test_channels_that_not_all_have_are_left_out_and_named(tmp_path):
    subjects = {"s01": CHANNELS[:6], "s02": CHANNELS, "s03": CHANNELS[1:]}
    units = {unit: run(tmp_path, unit=unit, channels=channels)[1] for unit, channels in subjects.items()}
    out = tmp_path / "group"
    out.mkdir()
    summary = ersp.run_group(SMALL, Inputs.of("group", ersp=units), out)
    assert list(read_table(out / "ersp.parquet")["channel"].unique()) == list(CHANNELS[1:6])
    expected = "the group has 5 of 8 channels, those of all: s01 lacks Pz, POz; s03 lacks Fz"
    assert summary["warnings"][0] == expected


def test_subjects_without_a_common_channel_are_refused(tmp_path):
    units = {u: run(tmp_path, unit=u, channels=c)[1] for u, c in (("s01", CHANNELS[:2]), ("s02", CHANNELS[2:]))}
    with pytest.raises(DataError, match=r"no EEG channel in common.* s01 has Fz, FC1; s02 has FC2"):
        ersp.run_group(SMALL, Inputs.of("group", ersp=units), tmp_path)


def test_contradictions_are_found():
    assert ersp.check(ersp.Config()) == []
    found = ersp.check(dataclasses.replace(ersp.Config(), low_hz=30.0, high_hz=4.0, channels=()))
    assert any("low_hz = 30 lies above high_hz = 4" in sentence for sentence in found)
    assert any("channels is empty" in sentence for sentence in found)
