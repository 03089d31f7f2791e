"""The events of a recording as BIDS has them: a table of the moves and marks, and what its columns mean."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from hrcneuro.export.sidecars import write_json

if TYPE_CHECKING:
    import mne
    import pandas as pd


def describe_events(base: Path, raw: mne.io.BaseRaw, trials: pd.DataFrame) -> None:
    """Write events.tsv: the trial table, and the recording's other annotations, in order of time."""
    import pandas as pd

    from hrcneuro.eeg.breaks import event_mark
    from hrcneuro.tables.trials import TRIALS

    known = trials[trials["onset_sample"].notna()]
    own = [c for c in TRIALS.columns if c not in ("subject", "event", "onset_s", "onset_sample")]
    used = [c for c in own if known[c].notna().any()]
    sample = known["onset_sample"].astype("int64")
    rows = pd.DataFrame(
        {
            "onset": known["onset_s"].astype(float),
            # An unknown duration is none, not one of 0 s.
            "duration": known["t_f_s"].astype(float),
            "trial_type": known["event"],
            "sample": sample,
            **{c: known[c] for c in used if c != "t_f_s"},
        }
    )
    marks = [(a["onset"], a["duration"], a["description"]) for a in raw.annotations]
    moves = {event_mark(str(event)) for event in known["event"]}
    others = pd.DataFrame([m for m in marks if m[2] not in moves], columns=["onset", "duration", "trial_type"])
    if len(others):
        others["sample"] = (others["onset"] * raw.info["sfreq"]).round().astype("int64")
        rows = pd.concat([rows.astype(object), others.astype(object)]).sort_values("onset", kind="stable")
    rows = rows.map(_cell)
    rows.to_csv(base.with_name(f"{base.name}_events.tsv"), sep="\t", index=False, na_rep="n/a")
    meaning: dict[str, Any] = {
        "onset": {"Description": "start of the event, from the first sample", "Units": "s"},
        "duration": {"Description": "duration of the motion; n/a where unknown", "Units": "s"},
        "trial_type": {"Description": "name of the event; BAD and EDGE mark what no analysis uses"},
        "sample": {"Description": "nearest sample, the first is 0"},
    }
    for name in rows.columns[4:]:
        column = TRIALS.columns[name]
        meaning[name] = {"Description": column.text, **({"Units": column.unit} if column.unit == "s" else {})}
    write_json(base.with_name(f"{base.name}_events.json"), meaning)


def _cell(value: Any) -> Any:
    import pandas as pd

    if value is None or value is pd.NA or value != value:
        return "n/a"
    if isinstance(value, bool) or type(value).__name__ == "bool":
        return "true" if value else "false"
    if isinstance(value, float):
        # As many digits as it takes to read the same number back.
        return f"{value:.0f}" if value.is_integer() and abs(value) < 1e12 else repr(float(value))
    return value
