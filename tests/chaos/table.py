"""Faults that were tried, what was survived and what was lost: counted by each script, printed as one table.

Lost is a finished result that is gone or has other bytes, or a run that says it succeeded and did not.
"""

import contextlib
import json
import os
import traceback
from dataclasses import asdict, dataclass, field
from pathlib import Path

PLACE = "CHAOS_ROWS"
"""The variable of the environment that names the file into which a script's rows go."""


class Lost(AssertionError):
    """A finished result is gone or has other bytes, or a run says what is not so."""


@dataclass
class Fault:
    """A fault, and how often it was tried, survived, and cost a result."""

    fault: str
    tried: int = 0
    survived: int = 0
    lost: int = 0
    note: str = ""
    reasons: list[str] = field(default_factory=list)

    @contextlib.contextmanager
    def trial(self, what=""):
        """Count what happens in the block; what is asserted there in vain counts as lost."""
        self.tried += 1
        try:
            yield
        except AssertionError as error:
            self.lost += 1
            self.reasons.append(f"{what}: {error}")
            print(f"LOST  {self.fault}, {what}: {error}", flush=True)
        else:
            self.survived += 1

    def count(self, script, what=""):
        """Count what a script returns that it has tried; where it breaks off, one is lost, and no more is known."""
        try:
            self.tried = self.survived = script()
        except (Exception, SystemExit) as error:
            traceback.print_exc()
            self.tried, self.lost = 1, 1
            self.reasons.append(f"{what}: {error}")
        return self

    def skip(self, reason):
        """Say why nothing could be tried: what was not tried was not survived either."""
        self.note = f"skipped: {reason}"
        return self


def shared_out(number, shares):
    """Return name -> a whole number by its share; in all so many, whichever names there are."""
    whole, left, numbers = sum(shares.values()), number, {}
    for name in sorted(shares, key=shares.get):
        numbers[name] = min(left, round(shares[name] / whole * number))
        left -= numbers[name]
        # What rounding has left over goes to the largest share, the last one.
        last = name
    return {name: numbers[name] + left * (name == last) for name in shares}


def tell(faults):
    """Print a script's rows, hand them to who runs all scripts, and return the exit code."""
    faults = list(faults)
    print("\n".join(lines(faults)), flush=True)
    if place := os.environ.get(PLACE):
        with Path(place).open("a", encoding="utf-8") as file:
            file.writelines(json.dumps(asdict(one)) + "\n" for one in faults)
    return int(any(one.lost for one in faults))


def read(place):
    """Return the rows that scripts have left in a file."""
    if not place.exists():
        return []
    return [Fault(**json.loads(line)) for line in place.read_text(encoding="utf-8").splitlines()]


def lines(faults):
    """Return a table's lines."""
    width = max([len(one.fault) for one in faults] + [5])
    head = f"{'fault':<{width}}  tried  survived  lost"
    rows = [f"{f.fault:<{width}}  {f.tried:5}  {f.survived:8}  {f.lost:4}  {f.note}".rstrip() for f in faults]
    return [head, "-" * len(head), *rows]
