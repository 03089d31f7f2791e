"""What came out of the evidence: a closed loop with people, scored, replayed and held against what was foretold."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from hrcneuro.answers.words import UNKNOWN, counted, indented, number, percent

Summary = Mapping[str, Any]
NAMES = {
    "eq3-6": "Eq 3-6 (the design tool)",
    "fixed": "the game, fixed partner",
    "adapting": "the game, partner who adapts",
    "eq3-6_early": "Eq 3-6, from the first 25 trials",
}
_BINS = {"balanced": "balanced accuracy", "run": "run"}


def evidence(summary: Summary) -> list[str]:
    """Return the decoder's accuracy, right guesses, the replay, and what was foretold beside what was seen."""
    return [*_decoder(summary), *_replay(summary["replay"]), *_design(summary), *_partners(summary["partners"])]


def _decoder(summary: Summary) -> list[str]:
    one = summary["decoder"]
    rows = [
        (f"{_BINS[row['by']]} {row['bin']}", counted(row["sessions"], "session"), _to(row["first"], row["last"]))
        for row in summary["guesses"]
    ]
    return [
        f"{counted(one['sessions'], 'session')} of {counted(one['subjects'], 'person', 'people')}, "
        f"{counted(one['trials'], 'trial')}: online balanced accuracy by person {number(one['mean'], 3)} ± "
        f"{number(one['sd'], 3)} (SD; {number(one['lowest'], 3)} to {number(one['highest'], 3)})",
        "right guesses, first ten trials → last ten:",
        *indented(rows),
    ]


def _to(first: float, last: float) -> str:
    return f"{number(first, 2)} → {number(last, 2)}"


def _replay(one: Summary) -> list[str]:
    rows = one["rows"]
    unsolved = f", none in {counted(one['unsolved'], 'trial')}" if one["unsolved"] else ""
    lines = [
        f"their learner: of {rows:,} rows of policies {percent(100 * one['rows_one'] / rows)} have one integer "
        f"solution for the transitions, {one['rows_several']:,} several, "
        f"{percent(100 * one['rows_truncated'] / rows)} truncated counts{unsolved}; all four rows of "
        f"{one['trials_one']:,} of {counted(one['trials'], 'trial')} have one",
        f"transitions inferred and logged are equal in {one['whole_agree']:,} of {counted(one['whole'], 'trial')} "
        f"solved whole; the logged number is possible in {one['allowed']:,} of {one['logged']:,}",
        f"{one['settled_paths']:,} of {counted(one['settled'], 'trial')} that this number settles are one path of the "
        f"gaze (rows of different trials: {_share(one['paths_by_chance'])})",
    ]
    of = f"{one['replayed']:,} of {counted(one['sessions'], 'session')}"
    if one["largest_difference"] is not None:
        lines.append(
            f"policies of {of}, replayed from them, differ from the logged ones by {one['largest_difference']:.1g} "
            "at most"
        )
    else:
        lines.append(f"policies of {of} could be replayed")
    for row in one["disagreeing"]:
        where = f"{row['subject']} run {row['run']} trial {row['trial']}"
        known = row["counted"] is not None
        inferred = f"{row['counted']} or more inferred" if known else "no transitions explain its policy"
        lines.append(f"disagrees: {where}: {row['transitions']} logged, {inferred}")
    if one["disagreeing"]:
        lines.append("what people saw in a trial that disagrees counts as not known")
    return lines


def _design(summary: Summary) -> list[str]:
    need, found, early = summary["design"], summary["success"], summary["success_early"]
    if need["accuracy"] is None:
        return ["the design tool finds no accuracy that is enough after so many trials"]
    told = [
        f"{name} ({counted(part['sessions'], 'session')} of {counted(part['people'], 'person', 'people')}): "
        f"{part['well']} ended so, {_share(part['share'])} ({_interval(part, _share)})"
        for name, part in ((name, found[name]) for name in ("above", "below"))
        if part["sessions"]
    ]
    rows = [
        (NAMES[name], *(f"{what} {_value(one[what])}" for what in ("slope", "bias", "error")))
        for name, one in sorted(summary["calibration"].items(), key=lambda item: list(NAMES).index(item[0]))
    ]
    return [
        f"the design tool asks for {number(need['accuracy'])} % right decisions (95 % band {number(need['low'])} to "
        f"{number(need['high'])}) for {found['right']} right guesses of the last ten; people {'; '.join(told)}",
        f"the same by the accuracy of the first 25 trials alone: {_early(early)}",
        "right guesses in the last ten trials, seen against foretold (slope 1, bias 0: come true; 95 % over people):",
        *indented(rows),
    ]


def _early(found: Summary) -> str:
    parts = {name: found[name] for name in ("above", "below")}
    return ", ".join(f"{name} {one['well']} of {one['sessions']}" for name, one in parts.items())


def _partners(one: Summary) -> list[str]:
    lines = [f"what people saw is known in {one['known']:,} of {counted(one['of'], 'trial')}"]
    if gain := one.get("gain"):
        lines.append(
            f"people who adapt are likelier than fixed ones by {number(gain['value'])} nats, each by what was fitted "
            f"to the others (95 % over people {_interval(gain, number)}; better in {gain['better']} of "
            f"{gain['people']})"
        )
    return lines


def _share(value: float | None) -> str:
    return UNKNOWN if value is None else f"{number(100 * value, 0)} %"


def _value(one: Summary) -> str:
    if one["value"] is None:
        return UNKNOWN
    return f"{number(one['value'], 2)} ({_interval(one, lambda value: number(value, 2))})"


def _interval(one: Summary, told: Callable[[float | None], str]) -> str:
    """Return ``0.40 to 1.49``, or that the interval is not known."""
    if one["low"] is None:
        return f"interval {UNKNOWN}"
    return f"{told(one['low'])} to {told(one['high'])}"
