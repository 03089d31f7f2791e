"""Let studies share a cache in many random ways: ``python tests/chaos/shared.py [SCHEDULES] [SEED] [STEPS]``.

Runs, forced runs and gc, alone and at once, kill -9 of any of them, copies and moves of studies. After each step every
entry that a study's results point at must be there and verify.
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "helpers"))

import shared_cache
from table import Fault, tell

if __name__ == "__main__":
    fault = Fault("studies that share a cache, in any order")
    sys.exit(tell([fault.count(lambda: shared_cache.main(*map(int, sys.argv[1:])))]))
