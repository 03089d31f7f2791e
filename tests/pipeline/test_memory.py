"""A process that computes jobs keeps the memory that it frees: it asks the system for no page twice."""

import errno
import subprocess
import sys

import pytest

from hrcneuro.pipeline.job import of_memory

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


@pytest.mark.parametrize(
    ("error", "of"),
    [
        (MemoryError(), True),
        (OSError(errno.ENOMEM, "Cannot allocate memory"), True),
        # As the loader says it where an address space is full, and numpy around it.
        (ImportError("libscipy_openblas64_.so: failed to map segment from shared object"), True),
        (ImportError("Importing the numpy C-extensions failed.\nOriginal error: x.so: Cannot allocate memory"), True),
        (ImportError("No module named 'numpy'"), False),
        (OSError(errno.ENOSPC, "No space left on device"), False),
        (ValueError("cannot allocate memory"), False),
    ],
)
def test_what_says_that_memory_ran_out(error, of):
    assert of_memory(error) is of
