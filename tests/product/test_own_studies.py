"""Studies of one's own, end to end in one folder: the tutorial's recording, two runs, and EEGLAB's sample."""

import importlib.util
import re
import shutil

import pytest
from tiny_study import ROOT

SAMPLE = ROOT.parent / "shared" / "data" / "eeglab_sample" / "eeglab_data.set"
TUTORIAL = (ROOT / "docs" / "start" / "tutorial.md").read_text()


@pytest.fixture
def folder(tmp_path):
    """The tutorial's study in a folder, as its third part has it."""
    pytest.importorskip("pybv", reason="needs the extra bids")
    spec = importlib.util.spec_from_file_location("make_recording", ROOT / "docs" / "start" / "make_recording.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    (tmp_path / "data").mkdir()
    module.main(tmp_path / "data")
    (tmp_path / "hrcneuro.toml").write_text(
        re.search(r"```toml\n(.*?)```", TUTORIAL.partition("## Part 3")[2], re.S)[1]
    )
    return tmp_path


def add_runs(folder):
    """Write a study of two subjects: the first has two runs, the second a path and a bad channel of its own."""
    data = folder / "data"
    for name in ("p1_run-1", "p1_run-2", "other"):
        for path in sorted(data.glob("demo.*")):
            text = path.read_bytes()
            (data / f"{name}{path.suffix}").write_bytes(
                text if path.suffix == ".eeg" else text.replace(b"demo", name.encode())
            )
    text = (folder / "hrcneuro.toml").read_text()
    text = text.replace('"oddball"', '"two runs"').replace('["demo"]', '["p1", "p2"]')
    text = text.replace("{subject}.vhdr", "{subject}_run-*.vhdr")
    text += '\n[acquire.subjects.p2]\npath = "data/other.vhdr"\nbads = ["C4"]\n'
    (folder / "runs.toml").write_text(text)


def run(hrcneuro, folder, *given):
    done = hrcneuro("run", *given, "--no-figures", "-j", "1", "--json", cwd=folder)
    assert done.code == 0, done.err
    assert {"simulate", "robot"}.isdisjoint(item["stage"] for item in done.json["items"])
    assert "left out: simulate and robot" in done.err
    return {(item["stage"], item["unit"]): item["summary"] for item in done.json["items"]}


def test_each_study_runs_to_its_end_and_has_a_report_that_no_other_overwrites(hrcneuro, folder):
    first = run(hrcneuro, folder)
    assert first["epoch", "demo"]["total"] == {"standard": 64, "target": 16}
    reports = folder / "results" / "reports"
    (one,) = reports.glob("*/report.html")
    page = one.read_bytes()

    add_runs(folder)
    second = run(hrcneuro, folder, "--config", "runs.toml")
    assert second["epoch", "p1"]["total"] == {"standard": 128, "target": 32}
    assert second["epoch", "p2"]["total"] == {"standard": 64, "target": 16}
    assert second["acquire", "p1"]["breaks"] == 1
    assert (second["acquire", "p1"]["bads"], second["acquire", "p2"]["bads"]) == ([], ["C4"])
    shown = hrcneuro("show", "epoch", "--config", "runs.toml", cwd=folder)
    assert (shown.code, shown.err) == (0, "")
    assert "epoch, p1" in shown.out
    assert "demo" not in shown.out

    assert len(list(reports.glob("*/report.html"))) == 2
    assert one.read_bytes() == page


def test_a_condition_without_a_trial_is_told_at_epoch_and_events_are_no_conditions(hrcneuro, folder):
    slip = ("--set", "conditions.target=event == 'targt'")
    done = hrcneuro("epoch", "demo", "--no-figures", "-j", "1", cwd=folder)
    assert done.code == 0, done.err
    assert "trials by event:\n    all  standard 64, target 16\n" in done.out
    assert "condition" not in done.out + done.err
    # Also of what is fresh: the query is no part of epoch's key.
    done = hrcneuro("epoch", "demo", "--no-figures", *slip, cwd=folder)
    note = "demo: no trial is of the condition target = \"event == 'targt'\" (did you mean 'target'?)"
    assert f"note: {note}\n" in done.err
    assert "3 fresh" in done.err
    items = hrcneuro("epoch", "demo", "--no-figures", "--json", *slip, cwd=folder).json["items"]
    assert next(item for item in items if item["stage"] == "epoch")["summary"]["warnings"] == [note]
    done = hrcneuro("epoch", "demo", "--no-figures", "--set", "conditions.target=evnt == 'target'", cwd=folder)
    assert done.code == 0
    assert "note: demo: conditions.target = \"evnt == 'target'\" cannot be evaluated" in done.err


@pytest.mark.skipif(not SAMPLE.is_file(), reason="needs EEGLAB's sample recording")
def test_eeglab_s_sample_runs_to_its_end(hrcneuro, tmp_path):
    for path in SAMPLE.parent.glob("eeglab_data.*"):
        shutil.copy(path, tmp_path)
    found = run(hrcneuro, tmp_path, "--config", "eeglab_sample", "--set", "acquire.path=eeglab_data.set")
    assert found["epoch", "demo"]["total"] == {"rt": 74, "square": 80}
    assert len(list((tmp_path / "results" / "reports").glob("*/report.html"))) == 1
