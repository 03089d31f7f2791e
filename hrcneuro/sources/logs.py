"""The authors' behaviour logs, ``sNN/subjectNN.csv`` with ``sNN/metadataNN.csv``, as the trial table.

Their peculiarities are dealt with here and nowhere else: x is the row, y the column, after the move; the metadata's
"End position y" is the start column; in an error whose intended move is north, East and West are logged the wrong way
round, so the executed direction is taken from the displacement.

Where an experiment wrote the log, what it kept beside tells which episodes were broken off, and who owned what.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from hrcneuro.errors import DataError, did_you_mean
from hrcneuro.paradigm.design import MOVE
from hrcneuro.sources import experiments, spreadsheets, words
from hrcneuro.sources.layout import dataset_files
from hrcneuro.sources.pointers import refuse_pointer

if TYPE_CHECKING:
    import pandas as pd

    from hrcneuro.sources.experiments import Kept

# What tells where episodes start and end, and how many moves they have; the rest of the metadata follows from the log.
_METADATA = {
    long: short
    for long, short in words.METADATA.items()
    if short in ("block", "episode") or short.endswith(("_row", "_col", "_moves"))
}
_CURE = "restore the subject's log and metadata from the authors' repository (git checkout)"


def read_log(folder: Path, subject: str) -> pd.DataFrame:
    """Return one row a move of a subject, annotated: the trial table without subject, onset_s and onset_sample.

    Args:
        folder: The folder that holds ``s01``, ``s02`` …
        subject: ``s01``.

    Raises:
        DataError: A file is missing, a Git LFS pointer, truncated, has wrong columns or values, or log and metadata
            contradict each other.
    """
    files = dataset_files(str(folder), subject, eeg=False)
    path = files["log"]
    if "metadata" not in files:
        raise DataError(
            f"{subject} has no {path.stem.replace('subject', 'metadata')}.csv, which tells where each episode starts; "
            f"{path.parent} holds {', '.join(sorted(p.name for p in path.parent.iterdir()))}",
            cure=_CURE,
        )
    return read_log_files(path, files["metadata"])


def read_log_files(path: Path, other: Path) -> pd.DataFrame:
    """Return the moves of a log and its metadata, as :func:`read_log`.

    Raises:
        DataError: One of them is a Git LFS pointer, truncated, has wrong columns or values, or they contradict each
            other.
    """
    kept = experiments.beside(path)
    if kept is None:
        return _read_pair(path, other, None)
    try:
        return _read_pair(path, other, kept)
    except DataError as error:
        raise DataError(error.problem, cure=experiments.CURE) from error


def _read_pair(path: Path, other: Path, kept: Kept | None) -> pd.DataFrame:
    from hrcneuro.paradigm.conditions import annotate

    # An experiment that is killed may leave the last line torn.
    log = _translate(_read(path, words.LOG, torn=kept is not None), path)
    metadata = _read(other, _METADATA)
    if kept is not None:
        metadata = _caught_up(log, metadata, kept)
    _compare(log, metadata, path, other)
    return annotate(_trials(log.merge(metadata, on=["block", "episode"], how="left"), path, kept or experiments.Kept()))


def _caught_up(log: pd.DataFrame, metadata: pd.DataFrame, kept: Kept) -> pd.DataFrame:
    """Return the metadata with the log's last moves counted: an experiment that was killed, or whose disk was full, may
    not have come to that."""
    import pandas as pd

    rows: dict[Any, Any] = {}
    for one in metadata.to_dict("records"):
        if (one["block"], one["episode"]) in rows:
            return metadata
        rows[one["block"], one["episode"]] = one
    last = next(reversed(rows), None)
    human = (log["key"] != "").groupby([log["block"], log["episode"]], sort=False)
    sizes = human.size()
    episode: Any
    for episode, keys in human.sum().items():
        moves = int(sizes[episode])
        # What was kept is never behind the log.
        known = episode in kept.ends and moves <= kept.moves.get(episode, 0)
        if not known or (episode in rows and episode != last):
            continue
        said = rows.get(episode, {"agent_moves": 0, "human_moves": 0})
        if moves > said["agent_moves"] + said["human_moves"]:
            counts = {"agent_moves": moves - int(keys), "human_moves": int(keys)}
            rows[episode] = {**dict(zip(metadata, (*episode, *kept.ends[episode]), strict=False)), **counts}
    return pd.DataFrame(list(rows.values()), columns=list(metadata))


def _read(path: Path, columns: dict[str, str], *, torn: bool = False) -> pd.DataFrame:
    """Return the named columns of a CSV file under short names; other columns are ignored, and a torn last line."""
    import pandas as pd

    refuse_pointer(path)
    try:
        content, separator = spreadsheets.opened(path)
        if torn:
            content.truncate(content.getvalue().rfind("\n") + 1)
        text = pd.read_csv(content, sep=separator, dtype=str, keep_default_na=False)
    except (pd.errors.ParserError, pd.errors.EmptyDataError, UnicodeError) as error:
        raise DataError(f"{path.name} cannot be read as CSV: {error}", cure=_CURE) from error
    missing = [name for name in columns if name not in text]
    if missing:
        spare = [str(name) for name in text if name not in columns]
        raise DataError(
            f"{path.name} lacks {len(missing)} of {len(columns)} columns, the first {missing[0]!r}"
            f"{did_you_mean(missing[0], spare)}; it has {', '.join(map(repr, text))}",
            cure="name the folder that holds the authors' s01, s02 … : --set acquire.path=FOLDER",
        )
    table = text[list(columns)].fillna("").rename(columns=columns)
    for long, short in columns.items():
        if short in ("episode", "trial", "row", "col") or short.endswith(("_row", "_col", "_moves")):
            _refuse(~table[short].str.fullmatch(r"\d{1,6}"), table[short], path, long, "a whole number")
            table[short] = table[short].astype(int)
    return table


def _refuse(bad: pd.Series, values: pd.Series, path: Path, column: str, allowed: str) -> None:
    """Raise where a value is bad, naming the first, and tell a file cut in the middle of its last line."""
    if not bad.any():
        return
    at = int(bad.to_numpy().argmax())
    cut = at == len(bad) - 1 and not path.read_bytes().endswith(b"\n")
    raise DataError(
        f"{path.name}, line {at + 2}: {column!r} is {values.iloc[at]!r}; allowed: {allowed}"
        + ("; the file ends within this line, so it is truncated" if cut else ""),
        cure=_CURE,
    )


def _translate(log: pd.DataFrame, path: Path) -> pd.DataFrame:
    """Return the log in the trial table's words."""
    out = log.copy()
    long = {short: name for name, short in words.LOG.items()}
    for name, known in words.WORDS.items():
        _refuse(~log[name].isin(list(known)), log[name], path, long[name], ", ".join(known))
        out[name] = log[name].map(known)
    blocks = log["block"].str.extract(r"^(Test|BLOCK) (\d+)$")
    _refuse(blocks[0].isna(), log["block"], path, "Block", "Test 1, Test 2, BLOCK 1 … BLOCK 12")
    out["practice"] = blocks[0] == "Test"
    out["number"] = blocks[1].astype(int)
    return out


def _compare(log: pd.DataFrame, metadata: pd.DataFrame, path: Path, other: Path) -> None:
    """Raise unless log and metadata list the same episodes with as many moves of each partner."""
    keys = ["block", "episode"]
    said = metadata.set_index(keys)[["agent_moves", "human_moves"]]
    if said.index.has_duplicates:
        raise DataError(f"{other.name} lists {_name(said.index[said.index.duplicated()][0])} twice", cure=_CURE)
    human = log["key"] != ""
    seen = log.assign(agent_moves=~human, human_moves=human).groupby(keys, sort=False)[list(said)].sum()
    unknown = seen.index.difference(said.index, sort=False)
    if len(unknown):
        raise DataError(
            f"{path.name} has {_name(unknown[0])}, which {other.name} does not list; they are not of one subject",
            cure=_CURE,
        )
    seen = seen.reindex(said.index, fill_value=0)
    differ = (seen != said).any(axis=1).to_numpy()
    if not differ.any():
        return
    first = int(differ.argmax())
    where = _name(said.index[first])
    got, want = seen.iloc[first], said.iloc[first]
    counts = (
        f"{got.agent_moves} moves of the robot and {got.human_moves} of the human, "
        f"not {want.agent_moves} and {want.human_moves}"
    )
    if not seen.iloc[first + 1 :].to_numpy().any() and (got <= want).all():
        lost = int((said - seen).to_numpy().sum())
        raise DataError(
            f"{path.name} is truncated: it ends in {where} with {counts}; {lost} moves are lost", cure=_CURE
        )
    raise DataError(
        f"{path.name} contradicts {other.name}: {where} has {counts} ({int(differ.sum())} of {len(said)} episodes "
        "differ); they are not of one subject, or one was edited",
        cure=_CURE,
    )


def _name(episode: Any) -> str:
    return f"{episode[0]}, episode {episode[1]}"


def _trials(log: pd.DataFrame, path: Path, kept: Kept) -> pd.DataFrame:
    """Return the raw columns of the trial table from a log that carries its episodes' start and goal tiles."""
    import pandas as pd

    from hrcneuro.sources.plans import robot_plans

    episode = log.groupby(["block", "episode"], sort=False)
    if (episode.cumcount() != log["trial"]).any():
        line = int((episode.cumcount() != log["trial"]).to_numpy().argmax()) + 2
        raise DataError(
            f"{path.name}, line {line}: moves are missing or out of order ('Trial' must count from 0)", cure=_CURE
        )
    start_row = episode["row"].shift().fillna(log["start_row"]).astype(int)
    start_col = episode["col"].shift().fillna(log["start_col"]).astype(int)
    executed = [_step(*tiles) for tiles in zip(start_row, start_col, log["row"], log["col"], strict=True)]
    human = log["key"] != ""
    intended = log["key"].where(human, robot_plans(log, human, executed, kept.directions))
    _check_tiles(log, executed, intended, path, kept)
    key_wrong = [key != "" and key not in target for key, target in zip(log["key"], log["target"], strict=True)]
    return pd.DataFrame(
        {
            "scenario": log["scenario"],
            "practice": log["practice"],
            "block": log["number"],
            "episode": log["episode"],
            "trial": log["trial"],
            "actor": human.map({True: "human", False: "robot"}),
            "intended": intended,
            "executed": pd.Series([step or None for step in executed], index=log.index, dtype=object),
            "target": log["target"],
            "error": log["error"].astype(bool),
            "row": log["row"],
            "col": log["col"],
            "key_wrong": key_wrong,
            "event": MOVE,
        }
    )


def _step(start_row: int, start_col: int, row: int, col: int) -> str:
    """Return the direction of a displacement, ``""`` for none, ``"?"`` for more than one step or off the grid."""
    from hrcneuro.paradigm.grid import displacement, inside

    if not inside((row, col)):
        return "?"
    try:
        return displacement((start_row, start_col), (row, col)) or ""
    except ValueError:
        return "?"


def _check_tiles(log: pd.DataFrame, executed: list[str], intended: pd.Series, path: Path, kept: Kept) -> None:
    """Raise where a tile cannot follow from the one before, or an episode that went on does not end on its goal."""
    import pandas as pd

    wrong = []
    for step, plan, logged, error in zip(executed, intended, log["logged"], log["error"], strict=True):
        wrong.append(step not in ("", words.mirrored(logged, error=error, intended=plan)))
    if any(wrong):
        at = wrong.index(True)
        row = log.iloc[at]
        raise DataError(
            f"{path.name}, line {at + 2}: the tile ({row.row}, {row.col}) cannot be reached by the logged move from "
            f"the one before (the metadata's start tile of this episode is ({row.start_row}, {row.start_col})); "
            "log and metadata are not of one subject, or one was edited",
            cure=_CURE,
        )
    last = log.groupby(["block", "episode"], sort=False).tail(1)
    astray = last[(last["row"] != last["goal_row"]) | (last["col"] != last["goal_col"])]
    ends = zip(astray["block"], astray["episode"], astray["trial"], strict=True)
    broken = [kept.broken_off((block, number), trial + 1) for block, number, trial in ends]
    astray = astray[~pd.Series(broken, index=astray.index, dtype=bool)]
    if len(astray):
        row = astray.iloc[0]
        raise DataError(
            f"{path.name}, line {astray.index[0] + 2}: {_name((row.block, row.episode))} ends on tile "
            f"({row.row}, {row.col}), not on its goal ({row.goal_row}, {row.goal_col}) of the metadata",
            cure=_CURE,
        )
