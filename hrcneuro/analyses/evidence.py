"""The evidence of the stage simulate: a closed loop with people, scored, replayed, and what was foretold of it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from hrcneuro.analyses import gaze_predictions as foretold
from hrcneuro.analyses import gaze_scores as scores
from hrcneuro.answers.words import counted
from hrcneuro.learning.gaze import PUBLISHED, UNSCORED_RUN, GazeSession
from hrcneuro.learning.gaze_partner import surface
from hrcneuro.learning.params import ADAPTING, FIXED, PARTNERS


def evidence(sessions: Sequence[GazeSession], config: Any) -> tuple[dict[str, pd.DataFrame], dict[str, Any]]:
    """Return the tables of the evidence, by the names of their files, and its summary.

    Args:
        sessions: As the logs have them.
        config: The options of the stage.
    """
    rows = scores.session_rows(sessions)
    people = scores.People(rows["subject"].tolist(), config.seed)
    tables = {"subjects": scores.subject_rows(sessions), "guesses": scores.guess_rows(sessions, rows, people)}
    replayed = scores.Replay(sessions)
    tables["trials"] = replayed.rows()
    told: dict[str, Any] = {
        "decoder": _decoder(rows, tables["subjects"]),
        "guesses": _guesses(rows),
        "replay": scores.replay_summary(tables["trials"], replayed.paths_by_chance()),
    }
    predictors = _foretell(rows, replayed, tables, told, config)
    tables["predicted"] = foretold.predicted_rows(rows, predictors, people)
    told |= _held_against(rows, predictors, people, told)
    tables["sessions"] = rows
    return tables, _plain(told) | {"warnings": _warnings(sessions, len(tables["subjects"]))}


def _warnings(sessions: Sequence[GazeSession], people: int) -> list[str]:
    """Return what was not there, of the published sessions, and what too few people leave unknown."""
    found = {(one.subject, one.run) for one in sessions}
    scored = {pair for pair in PUBLISHED if pair[1] != UNSCORED_RUN}
    warnings = []
    if lacking := sorted(PUBLISHED - found):
        names = [f"{subject} corl{run}" for subject, run in lacking]
        warnings.append(
            f"{len(PUBLISHED & found)} of the {len(PUBLISHED)} published closed sessions were found, "
            f"{len(scored & found)} of the {len(scored)} with guesses: the numbers are of these alone; missing: "
            f"{', '.join(names[:4])}{' …' if len(names) > 4 else ''}"
        )
    if people < scores.LEAST_PEOPLE:
        warnings.append(
            f"{counted(people, 'person', 'people')} with guesses: intervals over people are told from "
            f"{scores.LEAST_PEOPLE} people on"
            + (", and what the simulated partners foretell from 2, as they are fitted to others" if people < 2 else "")
        )
    return warnings


def _foretell(
    rows: pd.DataFrame,
    replayed: scores.Replay,
    tables: dict[str, pd.DataFrame],
    told: dict[str, Any],
    config: Any,
) -> list[str]:
    """Put what is foretold into the rows of sessions, into tables and summary; return the predictors' names."""
    tool = foretold.DesignTool(config)
    rows[foretold.DESIGN_TOOL] = tool.guesses(rows["balanced"].to_numpy())
    rows[f"{foretold.DESIGN_TOOL}_early"] = tool.guesses(rows["early_balanced"].to_numpy())
    reading = replayed.reading()
    likely = surface(reading)
    fitted = [foretold.fit_partner(likely, kind) for kind in PARTNERS if kind in config.evidence_partners]
    tables["partners"] = foretold.partner_rows(likely, fitted)
    lengths = np.concatenate([s.transitions for s in replayed.sessions if s.transitions is not None])
    design, inside = tool.rows(), {}
    rows[list(PARTNERS)] = np.nan
    for one in fitted:
        rows[one.kind], inside[one.kind] = foretold.play_sessions(rows, one, lengths, config)
        design += foretold.play_design(one, lengths, config)
    tables["design"] = pd.DataFrame(design)
    told["design"] = {name: getattr(tool.needed, name) for name in ("accuracy", "low", "high")}
    told["partners"] = {
        "known": int(reading.known.sum()),
        "of": int(reading.known.size),
        "inside": inside,
        "fits": tables["partners"].to_dict("records"),
        **({"gain": _gain(fitted, config)} if len(fitted) == len(PARTNERS) and fitted[0].others else {}),
    }
    return [foretold.DESIGN_TOOL, *(one.kind for one in fitted)]


def _gain(fitted: Sequence[foretold.FittedPartner], config: Any) -> dict[str, Any]:
    """Return how much likelier the guesses of people are, to whom it was not fitted, if people adapt."""
    of = {one.kind: one.held_out for one in fitted}
    names = sorted(of[FIXED])
    gain = np.array([of[ADAPTING][name] - of[FIXED][name] for name in names])
    low, high = scores.People(names, config.seed).interval(lambda times: times @ gain)
    value = {"value": float(gain.sum()), "low": low, "high": high}
    return value | {"people": len(gain), "better": int((gain > 0).sum())}


def _decoder(rows: pd.DataFrame, subjects: pd.DataFrame) -> dict[str, Any]:
    pooled = subjects["balanced"]
    return {
        "sessions": len(rows),
        "trials": int(rows["trials"].sum()),
        "subjects": len(subjects),
        "mean": float(pooled.mean()),
        "sd": float(pooled.std()),
        "lowest": float(pooled.min()),
        "highest": float(pooled.max()),
    }


def _guesses(rows: pd.DataFrame) -> list[dict[str, Any]]:
    """Return right guesses in the first and in the last ten trials, by the decoder's accuracy and by run."""
    told = [("balanced", interval, rows[rows["bin"] == interval]) for interval in scores.BINS]
    told += [("run", str(run), rows[rows["run"] == run]) for run in sorted(rows["run"].unique())]
    return [
        {
            "by": by,
            "bin": interval,
            "sessions": len(part),
            "first": float(part["first_right"].mean()),
            "last": float(part["last_right"].mean()),
        }
        for by, interval, part in told
        if len(part)
    ]


def _held_against(
    rows: pd.DataFrame, predictors: Sequence[str], people: scores.People, told: dict[str, Any]
) -> dict[str, Any]:
    """Return how far what was foretold came true."""
    seen = rows["last_right"].to_numpy()
    threshold = told["design"]["accuracy"] / 100
    early = f"{foretold.DESIGN_TOOL}_early"
    return {
        "success": foretold.success(rows["balanced"].to_numpy(), seen, threshold, people),
        "success_early": foretold.success(rows["early_balanced"].to_numpy(), seen, threshold, people),
        "calibration": {
            name: foretold.calibration(rows[name].to_numpy(), seen, people) for name in (*predictors, early)
        },
    }


def _plain(value: Any) -> Any:
    """Return numbers with six digits, and None for what is none."""
    if isinstance(value, dict):
        return {str(key): _plain(one) for key, one in value.items()}
    if isinstance(value, list):
        return [_plain(one) for one in value]
    if isinstance(value, float):
        return None if math.isnan(value) else float(f"{value:.6g}")
    return value
