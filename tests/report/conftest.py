"""What a finished smoke study left, as the report is handed it."""

import json

import pytest

from hrcneuro.pipeline.item import Item, State


@pytest.fixture(scope="session")
def smoke_items(smoke):
    """The rows that the run itself reported: a plan made now would call everything stale if the code changed since."""
    rows = json.loads((smoke / "done").read_text(encoding="utf-8"))["items"]
    return [
        Item(
            row["stage"],
            row["unit"],
            draws=row["kind"] == "pictures",
            key=row["key"],
            state=State(row["state"]),
            seconds=row["seconds"],
            artifacts=row["artifacts"],
            summary=row["summary"],
        )
        for row in rows
    ]
