"""The rules of the experiment (``paradigm.rules``) held against a study's moves: logged or simulated, without EEG."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from hrcneuro.errors import ConfigError
from hrcneuro.paradigm.params import SessionParams, TimingParams

if TYPE_CHECKING:
    import pandas as pd


class Source(Protocol):
    """What of acquire's configuration decides the moves."""

    @property
    def source(self) -> str: ...
    @property
    def path(self) -> str: ...
    @property
    def seed(self) -> int: ...
    @property
    def session(self) -> SessionParams: ...
    @property
    def timing(self) -> TimingParams: ...


def study_rules(configs: Mapping[str, Source]) -> pd.DataFrame:
    """Return one row a rule of these subjects' moves: rule, measured, target, ok (see ``paradigm.rules.check_rules``).

    Rules of timing are measured where the moves are timed by simulation; the authors' logs have no times. An episode
    that was broken off is left out: it has no goal.

    Raises:
        ConfigError: The source has no moves of this experiment.
        DataError: A log is missing, truncated or contradicts its metadata.
    """
    from hrcneuro.paradigm.rules import check_rules

    return check_rules({subject: _moves(config, subject) for subject, config in configs.items()})


def render(rules: pd.DataFrame, subjects: int) -> str:
    """Return the rules as a Markdown table, with a closing line."""
    rows = [["rule", "measured", "target", "holds"]]
    rows += [
        [one["rule"], _number(one["measured"]), one["target"], "yes" if one["ok"] else "NO"] for one in listed(rules)
    ]
    width = [max(len(row[i]) for row in rows) for i in range(4)]
    lines = ["| " + " | ".join(cell.ljust(w) for cell, w in zip(row, width, strict=True)) + " |" for row in rows]
    lines.insert(1, "|" + "|".join("-" * (w + 2) for w in width) + "|")
    broken = int((~rules["ok"]).sum())
    lines.append(f"\n{len(rules) - broken} of {len(rules)} rules hold, over {subjects} subjects")
    if broken and subjects < 12:
        lines.append("the limits leave room for chance in 12 subjects; fewer, or shorter sessions, may miss some")
    return "\n".join(lines)


def listed(rules: pd.DataFrame) -> list[dict[str, Any]]:
    """Return the rules in plain types, for JSON; what cannot be measured is None."""
    names = ("rule", "measured", "target", "ok")
    rows = zip(*(rules[name].tolist() for name in names), strict=True)
    plain = [dict(zip(names, row, strict=True)) for row in rows]
    return [one | {"measured": None if math.isnan(one["measured"]) else one["measured"]} for one in plain]


def _number(value: float | None) -> str:
    return "none" if value is None else f"{value:.4g}"


def _moves(config: Source, subject: str) -> pd.DataFrame:
    from hrcneuro.sources import layout, sessions, simulated
    from hrcneuro.sources.logs import read_log

    if config.source == "synthetic":
        return simulated.simulate_trials(subject, session=config.session, timing=config.timing, seed=config.seed)
    if config.source == "semisynthetic":
        moves = simulated.logged_trials(config.path, subject, timing=config.timing, seed=config.seed)
        return _arrived(moves, layout.dataset_files(config.path, subject, eeg=False))
    if config.source == "dataset":
        moves = read_log(Path(config.path).expanduser(), subject)
        return _arrived(moves, layout.dataset_files(config.path, subject, eeg=False))
    if config.source == "recording":
        files = layout.session_files(config.path, subject)
        return _arrived(sessions.read_moves(files), files)
    raise ConfigError(
        f"acquire.source = {config.source!r} has no moves of this experiment",
        cure="--rules is for source = synthetic, semisynthetic, dataset or recording",
    )


def _arrived(moves: pd.DataFrame, files: Mapping[str, Path]) -> pd.DataFrame:
    """Return the moves of the episodes that were not broken off."""
    from hrcneuro.paradigm.conditions import EPISODE
    from hrcneuro.sources import experiments
    from hrcneuro.sources.authors_log import block_name

    kept = experiments.beside(files["log"])
    if kept is None:
        return moves
    sizes = moves.groupby(list(EPISODE), sort=False)["trial"].transform("size")
    rows = zip(*(moves[name] for name in EPISODE), sizes, strict=True)
    stay = [not kept.broken_off((block_name(practice, block), number), size) for practice, block, number, size in rows]
    return moves[stay].reset_index(drop=True)
