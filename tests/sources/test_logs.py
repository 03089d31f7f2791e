"""The authors' logs: their quirks are undone, and every damage is named with its place and a cure."""

import shutil
from pathlib import Path

import pandas as pd
import pytest

from hrcneuro.errors import DataError
from hrcneuro.sources.logs import read_log

LOGS = Path(__file__).parents[2] / "../shared/data/HRC_neurobased_taskplanning"

LOG = """\
Scenario,Block,Episode,Trial,Target direction,Subject_key_pressed or agent,Movement direction,Error/NonError,\
Current x,Current y
Shared_Workspace,Test 2,1,0,South,Subject Down,south,NonError,2,1
Shared_Workspace,Test 2,1,1,South,Subject Up,north,NonError,1,1
Shared_Workspace,Test 2,1,2,South,Agent,south,NonError,2,1
Shared_Workspace,BLOCK 1,1,0,North,Subject Up,west,Error,5,2
Shared_Workspace,BLOCK 1,1,1,Northwest,Agent,north,NonError,4,2
Shared_Workspace,BLOCK 1,1,2,West,Agent,east,Error,4,3
Shared_Workspace,BLOCK 1,1,3,West,Agent,west,NonError,4,2
Shared_Workspace,BLOCK 1,1,4,West,Subject Left,west,NonError,4,1
"""
METADATA = """\
Block,Episode,Start position x,End position y,Goal position x,Goal position y,Agent errors,Agent total movements,\
Interface errors,Interface total movements
Test 2,1,1,1,2,1,0,1,1,2
BLOCK 1,1,5,1,4,1,1,3,1,2
"""


@pytest.fixture
def folder(tmp_path):
    """A folder in the authors' layout with a small subject s01; the log has an error that was meant to go north."""
    return write(tmp_path)


def write(folder, log=LOG, metadata=METADATA):
    home = folder / "s01"
    home.mkdir(exist_ok=True)
    (home / "subject01.csv").write_text(log)
    (home / "metadata01.csv").write_text(metadata)
    return folder


def refused(folder, match, subject="s01"):
    with pytest.raises(DataError, match=match) as error:
        read_log(folder, subject)
    assert error.value.cure
    return str(error.value)


def test_the_small_log_becomes_the_trial_table(folder):
    trials = read_log(folder, "s01")
    assert trials["practice"].tolist() == [True] * 3 + [False] * 5
    assert trials["block"].tolist() == [2] * 3 + [1] * 5
    assert trials["actor"].tolist() == ["human", "human", "robot", "human", "robot", "robot", "robot", "human"]
    assert trials["target"].tolist() == ["S", "S", "S", "N", "NW", "W", "W", "W"]
    assert trials["error"].tolist() == [False, False, False, True, False, True, False, False]
    assert trials["key_wrong"].tolist() == [False, True] + [False] * 6
    assert trials["condition_before"].tolist() == [None] * 4 + ["RR", None, "RH", None]
    assert (trials["event"] == "move").all()
    assert "onset_s" not in trials


def test_the_executed_direction_comes_from_the_tiles_not_from_the_mirrored_log(folder):
    trials = read_log(folder, "s01")
    # From (5, 1) to (5, 2) is east; the log says west, as in every error on a move north.
    assert trials["executed"].tolist() == ["S", "N", "S", "E", "N", "E", "W", "W"]


def test_what_the_robot_intended_follows_from_its_rule_where_the_log_tells_only_the_error(folder):
    assert read_log(folder, "s01")["intended"].tolist() == ["S", "N", "S", "N", "N", "W", "W", "W"]


def test_a_clamped_move_has_no_executed_direction(tmp_path):
    lines = [
        LOG.splitlines()[0],
        "Shared_Responsibility,BLOCK 1,1,0,North,Subject Up,east,Error,5,0",
        "Shared_Responsibility,BLOCK 1,1,1,Northeast,Subject Left,west,NonError,5,0",
        "Shared_Responsibility,BLOCK 1,1,2,Northeast,Subject Up,north,NonError,4,0",
        "Shared_Responsibility,BLOCK 1,1,3,East,Agent,east,NonError,4,1",
    ]
    metadata = [METADATA.splitlines()[0], "BLOCK 1,1,5,1,4,1,0,1,2,3"]
    trials = read_log(write(tmp_path, "\n".join(lines) + "\n", "\n".join(metadata) + "\n"), "s01")
    assert trials["executed"].tolist() == ["W", None, "N", "E"]
    assert trials["key_wrong"].tolist() == [False, True, False, False]
    assert trials["error"].tolist() == [True, False, False, False]


def test_a_missing_folder_subject_log_or_metadata_is_named(folder):
    refused(folder / "nowhere", "nowhere does not exist")
    assert "s01" in refused(folder, "no subject 's02'", subject="s02")
    (folder / "s01" / "metadata01.csv").unlink()
    assert "subject01.csv" in refused(folder, r"no metadata01\.csv")
    (folder / "s01" / "subject01.csv").unlink()
    refused(folder, r"no subject01\.csv")


@pytest.mark.parametrize("name", ["subject01.csv", "metadata01.csv"])
def test_a_git_lfs_pointer_is_told_from_the_data(folder, name):
    (folder / "s01" / name).write_text("version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n")
    assert "git lfs pull" in refused(folder, f"{name} is a Git LFS pointer")


def test_missing_columns_are_named_with_the_nearest_spelling(tmp_path):
    message = refused(write(tmp_path, LOG.replace("Target direction", "Target_direction")), "lacks 1 of 10 columns")
    assert "did you mean 'Target_direction'" in message
    refused(write(tmp_path, "a,b\n1,2\n"), "lacks 10 of 10")
    refused(write(tmp_path, ""), "cannot be read as CSV")


@pytest.mark.parametrize(
    ("old", "new", "match"),
    [
        ("Test 2,1,0,South,", "Test 2,1,0,Sauth,", "line 2: 'Target direction' is 'Sauth'; allowed: North"),
        ("Subject Up,west", "Subject up,west", "line 5: 'Subject_key_pressed or agent' is 'Subject up'"),
        ("BLOCK 1,1,1", "Block 1,1,1", "line 6: 'Block' is 'Block 1'; allowed: Test 1"),
        ("NonError,4,2", "NonError,4,two", "line 6: 'Current y' is 'two'; allowed: a whole number"),
        ("Shared_Workspace,BLOCK 1,1,3", "Shared,BLOCK 1,1,3", "line 8: 'Scenario' is 'Shared'"),
        ("BLOCK 1,1,3,", "BLOCK 1,1,5,", "line 8: moves are missing or out of order"),
        ("NonError,4,1", "NonError,4,0", "line 9: the tile"),
        ("NonError,4,1", "Error,4,1", None),
    ],
)
def test_a_damaged_line_is_named(tmp_path, old, new, match):
    write(tmp_path, LOG.replace(old, new, 1))
    if match:
        refused(tmp_path, match)
    else:
        assert read_log(tmp_path, "s01")["error"].iloc[-1]


def test_a_file_cut_at_or_within_a_line_is_truncated(tmp_path):
    lines = LOG.splitlines(keepends=True)
    message = refused(write(tmp_path, "".join(lines[:-2])), "truncated: it ends in BLOCK 1, episode 1")
    assert "2 moves of the robot and 1 of the human, not 3 and 2" in message
    assert "2 moves are lost" in message
    refused(write(tmp_path, "".join(lines[:4])), "5 moves are lost")
    assert "truncated" in refused(write(tmp_path, LOG[:-30]), "line 9: .* the file ends within this line")
    refused(write(tmp_path, lines[0]), "8 moves are lost")


def test_the_metadata_of_another_subject_are_refused(tmp_path):
    refused(write(tmp_path, metadata=METADATA.replace("BLOCK 1,1,5,1", "BLOCK 1,1,5,4")), "line 5: the tile")
    refused(write(tmp_path, metadata=METADATA.replace("1,3,1,2", "1,2,1,3")), "contradicts metadata01.csv: BLOCK 1, ep")
    refused(
        write(tmp_path, metadata=METADATA.replace("BLOCK 1", "BLOCK 2")), "has BLOCK 1, episode 1, which metadata01"
    )
    refused(write(tmp_path, metadata=METADATA.replace("5,1,4,1", "5,1,3,1")), r"ends on tile \(4, 1\), not on its goal")
    double = METADATA + METADATA.splitlines(keepends=True)[-1]
    refused(write(tmp_path, metadata=double), "lists BLOCK 1, episode 1 twice")


@pytest.fixture
def real(tmp_path):
    """A copy of the published logs of s01 and s02."""
    if not LOGS.is_dir():
        pytest.skip("the published logs are not at hand")
    for subject in ("s01", "s02"):
        shutil.copytree(LOGS / subject, tmp_path / subject)
    return tmp_path


def test_the_published_log_of_another_subject_is_refused(real):
    shutil.copy(real / "s02" / "subject02.csv", real / "s01" / "subject01.csv")
    refused(real, r"subject01\.csv contradicts metadata01\.csv: Test 1, episode 1 .* not of one subject")


def test_a_published_log_cut_anywhere_is_refused(real):
    path = real / "s01" / "subject01.csv"
    whole = path.read_bytes()
    for size in (40, 150, 5000, 60000, len(whole) - 3, len(whole) - 40):
        path.write_bytes(whole[:size])
        refused(real, "truncated|cannot be read|lacks")


def test_a_published_log_has_its_known_size_and_ends(real):
    trials = read_log(real, "s01")
    assert len(trials) == 2198
    assert trials["practice"].sum() == 116
    assert trials.groupby(["practice", "block"]).ngroups == 14
    assert (trials["scenario"] == "iC").eq(trials["block"] % 2 == 1).all()
    first = trials.iloc[0]
    assert (first["row"], first["col"], first["executed"]) == (4, 1, "N")
    assert isinstance(trials, pd.DataFrame)


@pytest.mark.parametrize(
    ("separator", "encoding", "head"),
    [
        (";", "utf-8", ""), ("\t", "utf-8-sig", ""), ("\t", "utf-16", ""), (",", "utf-8-sig", ""),
        (";", "utf-8", "sep=;\n"),
    ],
)  # fmt: skip
def test_a_log_that_a_spreadsheet_saved_is_the_same_log(folder, separator, encoding, head):
    expected = read_log(folder, "s01")
    for name, text in (("subject01", LOG), ("metadata01", METADATA)):
        saved = (head + text.replace(",", separator)).replace("\n", "\r\n")
        (folder / "s01" / f"{name}.csv").write_bytes(saved.encode(encoding))
    pd.testing.assert_frame_equal(read_log(folder, "s01"), expected)
