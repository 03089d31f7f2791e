"""The session logs of a closed loop: what is in them is read, and what is no such log is refused with its cure."""

import numpy as np
import pytest

from hrcneuro.errors import DataError
from hrcneuro.sources.gaze_layout import log_files
from hrcneuro.sources.gaze_logs import read_sessions
from tests.helpers import gaze_logs


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    folder = tmp_path_factory.mktemp("logs")
    return folder, gaze_logs.write_study(folder, subjects=2)


def test_what_was_written_is_read(study):
    folder, written = study
    found = read_sessions(folder)
    assert [(one.subject, one.run) for one in found] == [(one.subject, one.run) for one in written]
    for one, other in zip(found, written, strict=True):
        assert np.array_equal(one.error, other.error)
        assert np.array_equal(one.policies, other.policies)
        for name in ("right", "transitions"):
            kept, given = getattr(one, name), getattr(other, name)
            assert (kept is None) == (given is None) == (one.run == 3)
            assert kept is None or np.array_equal(kept, given)


def test_the_root_of_the_repository_serves_as_well_and_other_files_do_not_disturb(study, tmp_path):
    folder, _ = study
    home = tmp_path / "data_coadaptation"
    home.mkdir()
    for path in folder.iterdir():
        (home / path.name).write_bytes(path.read_bytes())
    (home / "s03_corl1.set").write_bytes(b"EEG")
    assert list(log_files(tmp_path)) == [
        f"{s} {k}" for s in ("s03", "s04") for k in ("calib", *map("corl{}".format, (1, 2, 3, 4)))
    ]
    assert len(read_sessions(tmp_path)) == 8


@pytest.fixture
def one(tmp_path):
    """Return a folder with one log, and its path."""
    made, _ = gaze_logs.session("s03", 1, seed=1)
    return tmp_path, gaze_logs.write_log(tmp_path, made)


def _without_a_column(text):
    head, *rows = text.splitlines()
    return "\n".join("\t".join(line.split("\t")[:-1]) for line in (head, *rows)) + "\n"


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (_without_a_column, ["s03_corl1_log lacks x33", "expected columns: Trial, nTrans"]),
        (lambda text: text.replace("guessCorr", "guess"), ["lacks guessCorr", "has guess, which it should not"]),
        (lambda text: text.replace("\t", ","), ["lacks Trial, nTrans"]),
        (lambda text: "\n".join(text.splitlines()[:-1]) + "\n", ["49 trials", "a whole session has 50", "cut off"]),
        (lambda text: text[:-30], ["row 50 has 2", "cells of 22"]),
        (lambda text: text.replace("\tnoError\t", "\tfine\t", 1), ["errpDetector is 'fine'", "noError, ERROR"]),
        (lambda text: text.replace("\n2\t", "\n9\t"), ["row 2: Trial is '9'", "counted from the first"]),
        (lambda text: text.replace("\n1\t", "\n1\t-"), ["row 1: nTrans is '-", "a whole number"]),
        (lambda text: text.replace("left", "up"), ["naoDecision is 'up'", "left, middle, right"]),
        (lambda text: "", ["lacks Trial"]),
    ],
)
def test_a_log_that_is_not_as_published_is_refused(one, change, said):
    folder, path = one
    path.write_text(change(path.read_text()))
    with pytest.raises(DataError) as caught:
        read_sessions(folder)
    for words in said:
        assert words in caught.value.problem or words in caught.value.cure
    assert "s03_corl1_log" in caught.value.problem
    assert caught.value.cure


@pytest.mark.parametrize(("cell", "said"), [("1.2", "a probability"), ("x", "a probability"), ("nan", "a probability")])
def test_a_policy_that_is_none_is_refused(one, cell, said):
    folder, path = one
    lines = path.read_text().splitlines()
    cells = lines[7].split("\t")
    cells[10] = cell
    lines[7] = "\t".join(cells)
    path.write_text("\n".join(lines))
    with pytest.raises(DataError, match=f"row 7: x.. is '{cell}'; allowed: {said}"):
        read_sessions(folder)


def test_a_row_that_does_not_sum_to_one_and_a_guess_that_contradicts_are_refused(one):
    folder, path = one
    text = path.read_text()
    lines = text.splitlines()
    cells = lines[3].split("\t")
    cells[lines[0].split("\t").index("x20")] = "0.9"
    path.write_text("\n".join([*lines[:3], "\t".join(cells), *lines[4:]]))
    with pytest.raises(DataError, match=r"row 3: x20 to x23 is '1\.\d+ in all'"):
        read_sessions(folder)
    cells = lines[3].split("\t")
    cells[4] = str(1 - int(cells[4]))
    path.write_text("\n".join([*lines[:3], "\t".join(cells), *lines[4:]]))
    with pytest.raises(DataError, match=r"guessCorr is '[01]'; allowed: 1 where both decisions are the same"):
        read_sessions(folder)


TURNED = {"ERROR": "noError", "noError": "ERROR"}


def _turn(path, rows):
    lines = [line.split("\t") for line in path.read_text().splitlines()]
    at = lines[0].index("errpDetector")
    for row in rows:
        lines[row][at] = TURNED[lines[row][at]]
    path.write_text("\n".join("\t".join(line) for line in lines) + "\n")


@pytest.mark.parametrize("run", [1, 3])
def test_what_the_decoder_said_cannot_be_altered(tmp_path, run):
    made, _ = gaze_logs.session("s03", run, seed=1)
    path = gaze_logs.write_log(tmp_path, made)
    # Where runs are read, one with guesses must be there.
    gaze_logs.write_log(tmp_path, gaze_logs.session("s04", 1, seed=2)[0])
    _turn(path, (5, 9, 20, 30, 41))
    said = "ERROR" if not made.error[4] else "noError"
    with pytest.raises(DataError) as caught:
        read_sessions(tmp_path)
    assert f"s03_corl{run}_log, row 5: errpDetector is '{said}'" in caught.value.problem
    assert f"with '{TURNED[said]}' they would; 5 of 50 rows are so; allowed: none" in caught.value.problem
    assert "a log that was edited is no evidence" in caught.value.cure
    _turn(path, (5, 9, 20, 30, 41))
    assert len(read_sessions(tmp_path)) == 2


def test_a_policy_cannot_be_altered_though_its_rows_sum_to_one(one):
    folder, path = one
    lines = [line.split("\t") for line in path.read_text().splitlines()]
    columns = [lines[0].index(f"x2{j}") for j in range(4)]
    row = np.array([float(lines[6][i]) for i in columns])
    row[[row.argmax(), row.argmin()]] += (-0.001, 0.001)
    for i, value in zip(columns, row, strict=True):
        lines[6][i] = f"{value:.12g}"
    path.write_text("\n".join("\t".join(line) for line in lines) + "\n")
    with pytest.raises(DataError, match=r"row 6: .*no gaze transitions make its policy of the one before; 2 of 50"):
        read_sessions(folder)


def test_another_study_is_named_as_such(tmp_path):
    (tmp_path / "s01").mkdir()
    (tmp_path / "s01" / "subject01.csv").write_text("Scenario,Block\n")
    with pytest.raises(DataError, match=r"s01/subject01\.csv, a trial log of the study on the grid") as caught:
        log_files(tmp_path)
    assert "dataset-ErrP-coadaptation" in caught.value.cure
    assert "--evidence FOLDER" in caught.value.cure


@pytest.mark.parametrize("names", [[], ["s03_corl3_log"], ["s03_calib_log"], ["notes.txt", "s03_corl1_log.bak"]])
def test_a_folder_without_a_scored_session_is_no_evidence(tmp_path, names):
    for name in names:
        (tmp_path / name).write_text("")
    with pytest.raises(DataError, match=names[0] if names else "holds nothing"):
        log_files(tmp_path)


def test_a_folder_that_is_not_there_or_is_a_file(tmp_path):
    with pytest.raises(DataError, match="does not exist"):
        log_files(tmp_path / "nowhere")
    (tmp_path / "file").write_text("")
    with pytest.raises(DataError, match="is a file"):
        log_files(tmp_path / "file")


def test_a_stand_in_for_a_log_says_how_to_fetch_it(one):
    folder, path = one
    path.write_text("version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n")
    with pytest.raises(DataError, match="Git LFS pointer"):
        read_sessions(folder)
