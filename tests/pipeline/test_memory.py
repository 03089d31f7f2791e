"""A process that computes jobs keeps the memory that it frees: it asks the system for no page twice."""

import subprocess
import sys

import pytest

PAGES_OF_A_SECOND_ARRAY = """
import resource
import numpy as np
from hrcneuro.pipeline.job import keep_memory

def pages():
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt

kept = keep_memory() if {keep} else False
np.ones(8 << 20)
before = pages()
np.ones(8 << 20)
print(kept, pages() - before)
"""


def second_array(*, keep: bool) -> tuple[bool, int]:
    """Return whether the C library can keep memory, and how many pages 64 MB took that had been there before."""
    code = PAGES_OF_A_SECOND_ARRAY.format(keep=keep)
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    kept, pages = told.stdout.split()
    return kept == "True", int(pages)


def test_what_was_freed_is_used_again():
    kept, pages = second_array(keep=True)
    if not kept:
        pytest.skip("this system's C library cannot be told")
    # Huge pages are 32 for this array; each cost as much as 512 others to clear.
    assert pages < 16 <= second_array(keep=False)[1]
