"""What the live side survives, in the table: ``python tests/chaos/of_the_live_side.py SCRIPT [NUMBER…]``.

SCRIPT is ``experiment_kills``, ``experiment_subjects`` or ``loop_kills`` of ``tests/product``, which say what they do.
"""

import importlib
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "product"))

from table import Fault, tell

WORDS = {
    "experiment_kills": "kill -9, an experiment",
    "experiment_subjects": "subjects of an experiment, one after the other",
    "loop_kills": "kill -9, a closed loop",
}

if __name__ == "__main__":
    name, *numbers = sys.argv[1:]
    fault = Fault(WORDS[name])
    sys.exit(tell([fault.count(lambda: importlib.import_module(name).main(*map(int, numbers)), name)]))
