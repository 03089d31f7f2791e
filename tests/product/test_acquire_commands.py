"""acquire --export and --rules as a user meets them."""

import json

import pandas as pd
import pytest


@pytest.fixture(scope="module")
def exported(tmp_path_factory, hrcneuro):
    """A tiny study, exported: its configuration, its working folder and its layout."""
    from tiny_study import write_tiny

    base = write_tiny(tmp_path_factory.mktemp("export"))
    arguments = ["--config", base / "tiny.toml", "--workdir", base / "work", "-j", "1"]
    done = hrcneuro("acquire", *arguments, "--export", base / "layout", "--json")
    assert done.code == 0, done.err
    return base, arguments, done


def test_an_exported_study_is_acquired_again_with_the_same_counts_and_onsets(hrcneuro, exported, tmp_path):
    base, arguments, done = exported
    told = {item["unit"]: item["summary"]["export"] for item in done.json["items"]}
    assert set(told) == {"s01", "s02"}
    assert all(one["state"] == "ran" and one["notes"] == [] for one in told.values())
    source = ["--set", "acquire.source=dataset", "--set", f"acquire.path={base / 'layout'}"]
    again = hrcneuro("epoch", "s01", "s02", *arguments[:2], "--workdir", tmp_path, *source, "--json")
    first = hrcneuro("epoch", "s01", "s02", *arguments, "--json")
    assert (first.code, again.code) == (0, 0), again.err
    files, counts = [], []
    for run in (first, again):
        items = {(i["stage"], i["unit"]): i for i in run.json["items"]}
        counts.append([items["epoch", unit]["summary"]["counts"] for unit in ("s01", "s02")])
        files.append([pd.read_parquet(items["acquire", u]["artifacts"]["trials.parquet"]) for u in ("s01", "s02")])
    assert counts[0] == counts[1]
    for one, other in zip(*files, strict=True):
        pd.testing.assert_frame_equal(one.drop(columns="t_f_s"), other.drop(columns="t_f_s"))


def test_a_second_export_is_a_hit_and_a_foreign_folder_is_refused(hrcneuro, exported):
    base, arguments, _ = exported
    again = hrcneuro("acquire", *arguments, "--export", base / "layout")
    assert again.code == 0
    assert "= export s01" in again.err
    other = hrcneuro("acquire", *arguments, "--set", "acquire.seed=7", "--export", base / "layout")
    assert other.code == 2
    assert "other settings" in other.err
    assert "cure" in other.err
    dry = hrcneuro("acquire", *arguments, "--export", base / "nowhere", "--dry-run")
    assert dry.code == 0
    assert not (base / "nowhere").exists()


def test_the_rules_are_printed_as_a_table_and_as_json(hrcneuro, exported):
    _, arguments, _ = exported
    table = hrcneuro("acquire", *arguments, "--rules")
    assert table.code == 0
    assert table.out.startswith("| rule ")
    rows = [line for line in table.out.splitlines() if line.startswith("| ")]
    found = json.loads(hrcneuro("acquire", *arguments, "--rules", "--json").out)["rules"]
    assert len(found) == len(rows) - 1
    never = next(rule for rule in found if rule["rule"] == "errors right after an error")
    assert never == {"rule": "errors right after an error", "measured": 0.0, "target": "0", "ok": True}


def test_options_that_ask_for_different_things_are_refused(hrcneuro, tmp_path):
    done = hrcneuro("acquire", "--rules", "--inspect", "--workdir", tmp_path)
    assert done.code == 2
    assert "--inspect and --rules do not go together" in done.err
    other = hrcneuro("acquire", "--rules", "--set", "acquire.source=file", "--workdir", tmp_path)
    assert other.code == 2
    assert "no moves of this experiment" in other.err
