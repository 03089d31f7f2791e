"""What a BIDS data set tells of a study, so that nobody has to write it down again: its name, and who took part."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Mapping
from typing import Any

from hrcneuro.errors import HrcError
from hrcneuro.sources import bids_layout

# With more conditions than this, which of them are to be compared is for the study to say.
_FEW = 4


def complete(parts: dict[str, Any], origins: Mapping[str, str]) -> list[str]:
    """Fill in what nobody has set from the data set, in place; return what stands against that.

    Name and subjects are the data set's; nobody is excluded and nothing is split, as the paper's study is. Contrasts
    and decoding problems are the pairs of the conditions, where those are few.

    Args:
        parts: The options, by section.
        origins: Where each value that somebody has set comes from.
    """
    given = {key.partition(".")[0] for key in origins} | set(origins)
    try:
        root = bids_layout.root_of(parts["acquire"].path)
        found = {"subjects": bids_layout.subjects(root), "name": bids_layout.name_of(root) or root.resolve().name}
    except HrcError as error:
        return [f"[acquire] {error.problem}; {error.cure}"]
    # The paper's study is split by its scenarios, which an export of it has.
    found |= {"exclude": (), "split": "scenario" if bids_layout.is_ours(root) and "conditions" not in given else ""}
    unset = {name: value for name, value in found.items() if f"study.{name}" not in given}
    parts["study"] = dataclasses.replace(parts["study"], **unset)
    conditions = parts["shared"].conditions
    if "conditions" in given:
        pairs = {f"{one}-{two}": (one, two) for one, two in itertools.combinations(conditions, 2)}
        pairs = pairs if len(conditions) <= _FEW else {}
        tables = {name: pairs for name in ("contrasts", "problems") if name not in given}
        parts["shared"] = dataclasses.replace(parts["shared"], **tables)
    return []
