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

kept = {keep}
np.ones(8 << 20)
before = pages()
np.ones(8 << 20)
print(kept, pages() - before)
"""


def second_array(keep: str) -> tuple[bool, int]:
    """Return whether the C library can keep memory, and how many pages 64 MB took that had been there before."""
    code = PAGES_OF_A_SECOND_ARRAY.format(keep=keep)
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    kept, pages = told.stdout.split()
    return kept == "True", int(pages)


def test_what_was_freed_is_used_again_but_for_large_blocks_that_grow():
    kept, pages = second_array("keep_memory()")
    if not kept:
        pytest.skip("this system's C library cannot be told")
    # Huge pages are 32 for this array; each cost as much as 512 others to clear.
    assert pages < 16
    for otherwise in ("None", "keep_memory(growing=True)", "keep_memory() and keep_memory(growing=True)"):
        assert second_array(otherwise)[1] >= 16
