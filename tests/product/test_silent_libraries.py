"""What libraries tell programmers does not reach a user's terminal."""

import json


def test_a_picture_without_a_folder_for_matplotlib_is_drawn_in_silence(hrcneuro, tmp_path):
    (tmp_path / "file").write_text("no folder")
    place = {"MPLCONFIGDIR": str(tmp_path / "file" / "matplotlib"), "HOME": str(tmp_path / "file")}
    short = [f"--set=simulate.{value}" for value in ("repetitions=2", "episodes=20")]
    done = hrcneuro("simulate", *short, "--workdir", tmp_path / "study", "-j", "1", env=place)
    assert done.code == 0, done.err
    assert "atplotlib" not in done.err
    records = (tmp_path / "study" / "cache" / "simulate.figures").rglob("record.json")
    said = [json.loads(path.read_text())["provenance"]["warnings"] for path in records]
    assert any("matplotlib" in line for lines in said for line in lines)
    report = hrcneuro("report", *short, "--workdir", tmp_path / "study", "-j", "1", env=place)
    assert report.code == 0, report.err
    told = [line for line in report.err.strip().splitlines() if not line.startswith("note: 83 of 84 results")]
    assert told == [f"report: {tmp_path}/study/results/report.html"]
