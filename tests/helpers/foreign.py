"""Writers of small foreign recordings and of the authors' layout, quirks included; fixtures that hand them out."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import scipy.io

from hrcneuro.paradigm.session import SessionParams, simulate_session
from hrcneuro.sources.channels import standard_montage

NAMES = ["Fp1", "Fp2", "C3", "C4", "Cz", "Pz", "EOG1", "EOG3", "EOG3"]
_TARGETS = {
    "N": "North", "NE": "Northeast", "E": "East", "SE": "Southeast",
    "S": "South", "SW": "Southwest", "W": "West", "NW": "Northwest",
}  # fmt: skip
_MOVES = {"N": "north", "E": "east", "S": "south", "W": "west"}
_KEYS = {"N": "Subject Up", "E": "Subject Right", "S": "Subject Down", "W": "Subject Left"}
_STEPS = {"N": (-1, 0), "E": (0, 1), "S": (1, 0), "W": (0, -1)}


def eeg_uv(channels: int, samples: int, seed: int = 0) -> np.ndarray:
    """Noise of 10 µV, as large as EEG, in single precision."""
    return np.random.default_rng(seed).normal(0, 10, (channels, samples)).astype(np.float32)


def save_set(
    path: Path,
    data_uv: np.ndarray,
    names: Sequence[str],
    sfreq: float,
    events: Sequence[tuple[object, float]],
    *,
    positions: bool = False,
) -> Path:
    """Write an EEGLAB v5 data set: header in ``.set``, samples in ``.fdt``; latencies count from one."""
    place = standard_montage().get_positions()["ch_pos"]
    chanlocs = np.zeros(len(names), dtype=[(k, object) for k in ("labels", "X", "Y", "Z", "type")])
    for row, name in zip(chanlocs, names, strict=True):
        x, y, z = place[name] * 1000 if positions and name in place else [np.zeros((0, 0))] * 3
        row["labels"], row["type"] = name, ""
        # EEGLAB's X points to the nose, MNE's to the right ear.
        row["X"], row["Y"], row["Z"] = y, -x if positions and name in place else x, z
    event = np.zeros(len(events), dtype=[("type", object), ("latency", object), ("duration", object)])
    for row, (kind, latency) in zip(event, events, strict=True):
        row["type"], row["latency"], row["duration"] = kind, float(latency), np.zeros((0, 0))
    header = {
        "setname": path.stem, "filename": path.name, "filepath": "/home/someone", "nbchan": float(len(names)),
        "trials": 1.0, "pnts": float(data_uv.shape[1]), "srate": float(sfreq), "xmin": 0.0,
        "xmax": (data_uv.shape[1] - 1) / sfreq, "data": f"{path.stem}.fdt", "chanlocs": chanlocs, "event": event,
        "ref": "common", "icawinv": [], "icasphere": [], "icaweights": [], "comments": "",
    }  # fmt: skip
    path.parent.mkdir(parents=True, exist_ok=True)
    scipy.io.savemat(path, {"EEG": header}, oned_as="row")
    data_uv.astype("<f4").T.tofile(path.with_suffix(".fdt"))
    return path


def save_log(folder: Path, subject: str, trials: pd.DataFrame) -> None:
    """Write a subject's log and metadata in the authors' words, with their mistakes, in their layout."""
    save_log_files(folder / subject, subject, trials)


def save_log_files(home: Path, subject: str, trials: pd.DataFrame) -> None:
    """Write both files into the folder ``home``."""
    log, metadata = [], []
    for (practice, block, episode), moves in trials.groupby(["practice", "block", "episode"], sort=False):
        name = f"{'Test' if practice else 'BLOCK'} {block}"
        first, last = moves.iloc[0], moves.iloc[-1]
        step = _STEPS.get(first.executed, (0, 0))
        metadata.append(_metadata(name, episode, moves, (first.row - step[0], first.col - step[1]), last))
        log += [_log_row(name, move) for move in moves.itertuples()]
    home.mkdir(parents=True, exist_ok=True)
    pd.DataFrame(log).to_csv(home / f"subject{subject[1:]}.csv", index=False)
    pd.DataFrame(metadata).to_csv(home / f"metadata{subject[1:]}.csv", index=False)


def _log_row(block: str, move: object) -> dict[str, object]:
    went = move.executed or next(d for d in _STEPS if d != move.intended)
    if move.error and move.intended == "N":
        went = {"E": "W", "W": "E"}.get(went, went)
    return {
        "Scenario": "Shared_Responsibility" if move.scenario == "iC" else "Shared_Workspace",
        "Block": block, "Episode": move.episode, "Trial": move.trial, "Target direction": _TARGETS[move.target],
        "Subject_key_pressed or agent": "Agent" if move.actor == "robot" else _KEYS[move.intended],
        "Movement direction": _MOVES[went], "Error/NonError": "Error" if move.error else "NonError",
        "Current x": move.row, "Current y": move.col,
    }  # fmt: skip


def _metadata(block: str, episode: int, moves: pd.DataFrame, start: tuple[int, int], last: pd.Series) -> dict:
    human = moves["actor"] == "human"
    return {
        "Block": block, "Episode": episode, "Start position x": start[0], "End position y": start[1],
        "Goal position x": last.row, "Goal position y": last.col, "Agent errors": 0,
        "Agent total movements": int((~human).sum()), "Interface errors": 0,
        "Interface total movements": int(human.sum()),
    }  # fmt: skip


@pytest.fixture(scope="session")
def moves() -> Callable[[int], pd.DataFrame]:
    """Short simulated sessions: practice, then two blocks of three episodes."""
    params = SessionParams(practice_episodes=1, blocks=2, episodes_per_block=3)
    return lambda seed: simulate_session(params, rng=np.random.default_rng(seed))


@pytest.fixture
def study(tmp_path: Path, moves: Callable[[int], pd.DataFrame]) -> Callable[..., pd.DataFrame]:
    """Write subjects in the authors' layout under ``tmp_path / "study"``; onsets carry numeric code 33025."""

    def write(
        subject: str = "s01",
        *,
        seed: int = 1,
        sfreq: float = 256.0,
        practice: bool = True,
        names: Sequence[str] = NAMES,
        others: Sequence[tuple[object, float]] = (),
        jitter: float = 0.3,
        log_seed: int | None = None,
    ) -> pd.DataFrame:
        folder = tmp_path / "study"
        trials = moves(seed)
        save_log(folder, subject, trials if log_seed is None else moves(log_seed))
        marked = trials if practice else trials[~trials["practice"]]
        # 1-based, and between two samples as EEGLAB leaves them after resampling.
        events = [(33025, round(t * sfreq) + 1 + jitter) for t in marked["onset_s"]]
        events += [(33281, at + 64) for _, at in events[::7]] + list(others)
        samples = int((trials["onset_s"].max() + 3) * sfreq)
        events = sorted(events, key=lambda e: e[1])
        save_set(folder / subject / f"{subject}.set", eeg_uv(len(names), samples), names, sfreq, events)
        return trials

    return write


def save_xdf(path: Path, streams: Sequence[dict]) -> Path:
    """Write an XDF 1.0 file. A stream: name, type, srate, format, labels, units, types, stamps, samples; source_id;
    counted, the samples that its footer counts, None for no footer; clocks, whether its clock was compared.
    """
    chunks = [_chunk(1, b"<?xml version='1.0'?><info><version>1.0</version></info>")]
    for number, stream in enumerate(streams, start=1):
        number_bytes = struct.pack("<I", number)
        chunks.append(_chunk(2, number_bytes + _stream_header(stream).encode()))
        body = b"".join(
            b"\x08" + struct.pack("<d", stamp) + _values(stream, value)
            for stamp, value in zip(stream["stamps"], stream["samples"], strict=True)
        )
        count = b"\x04" + struct.pack("<I", len(stream["stamps"]))
        chunks += [_chunk(3, number_bytes + count + body)] if body else []
        compared = len(stream["stamps"]) and stream.get("clocks", True)
        ends = (stream["stamps"][0], stream["stamps"][-1]) if compared else ()
        clocks = [struct.pack("<dd", stamp, stream.get("offset", 0.0)) for stamp in ends]
        chunks += [_chunk(4, number_bytes + clock) for clock in clocks]
        total = stream.get("counted", len(stream["stamps"]))
        footer = f"<?xml version='1.0'?><info><sample_count>{total}</sample_count></info>"
        chunks += [] if total is None else [_chunk(6, number_bytes + footer.encode())]
    path.write_bytes(b"XDF:" + b"".join(chunks))
    return path


def _chunk(tag: int, content: bytes) -> bytes:
    return b"\x04" + struct.pack("<I", len(content) + 2) + struct.pack("<H", tag) + content


def _values(stream: dict, value: object) -> bytes:
    if stream["format"] == "string":
        text = str(value).encode()
        return b"\x04" + struct.pack("<I", len(text)) + text
    return np.asarray(value, {"float32": "<f4", "double64": "<f8", "int32": "<i4"}[stream["format"]]).tobytes()


def _stream_header(stream: dict) -> str:
    labels = stream.get("labels", [])
    count = len(labels) or np.size(stream["samples"][0])
    channels = "".join(
        f"<channel><label>{label}</label><unit>{unit}</unit><type>{kind}</type></channel>"
        for label, unit, kind in zip(
            labels,
            stream.get("units", ["microvolts"] * len(labels)),
            stream.get("types", ["EEG"] * len(labels)),
            strict=True,
        )
    )
    desc = f"<desc><channels>{channels}</channels></desc>" if labels else "<desc></desc>"
    return (
        f"<?xml version='1.0'?><info><name>{stream['name']}</name><type>{stream['type']}</type>"
        f"<channel_count>{count}</channel_count><nominal_srate>{stream['srate']}</nominal_srate>"
        f"<channel_format>{stream['format']}</channel_format><created_at>1</created_at>"
        f"<source_id>{stream.get('source_id', '')}</source_id>{desc}</info>"
    )


@pytest.fixture
def write_set() -> Callable[..., Path]:
    return save_set


@pytest.fixture
def write_xdf() -> Callable[..., Path]:
    return save_xdf


@pytest.fixture
def write_log() -> Callable[..., None]:
    return save_log


@pytest.fixture
def noise_uv() -> Callable[..., np.ndarray]:
    return eeg_uv
