"""Parquet artifacts: what is missing stays missing, enumerations keep the order in which they came."""

import io
import subprocess
import sys
import threading
from typing import ClassVar

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from hrcneuro.io.tables import Column, Table, read_lists, read_table, write_table

TABLE = Table(
    1,
    "one row a thing",
    {
        "kind": Column("category", "", "an enumeration"),
        "name": Column("string", "", "a name"),
        "values": Column("float32[]", "uV", "a list"),
    },
)


@pytest.mark.parametrize("kinds", [["b", "a", None, "b"], [None] * 4, [np.nan, "x", "x", None], [2, 1, 2, 2]])
def test_words_and_gaps_come_back(tmp_path, kinds):
    values = np.arange(8.0).reshape(4, 2)
    frame = pd.DataFrame({"kind": kinds, "name": kinds})
    write_table({"kind": frame["kind"], "name": frame["name"], "values": values}, tmp_path / "t.parquet", TABLE)
    expected = [None if pd.isna(kind) else str(kind) for kind in frame["kind"]]
    found = pq.read_table(tmp_path / "t.parquet")
    assert found["kind"].to_pylist() == found["name"].to_pylist() == expected
    words = list(dict.fromkeys(word for word in expected if word is not None))
    assert found["kind"].combine_chunks().dictionary.to_pylist() == words
    np.testing.assert_array_equal(read_lists(tmp_path / "t.parquet", "values"), values)


def test_a_table_may_be_empty(tmp_path):
    write_table({"kind": [], "name": [], "values": []}, tmp_path / "t.parquet", TABLE)
    assert read_table(tmp_path / "t.parquet").empty


class _Watched(io.FileIO):
    """A file that remembers which threads read it."""

    readers: ClassVar[set[int]] = set()

    def read(self, *size):
        self.readers.add(threading.get_ident())
        return super().read(*size)

    def readinto(self, buffer):
        self.readers.add(threading.get_ident())
        return super().readinto(buffer)


def test_a_table_is_read_by_the_thread_that_asks(tmp_path):
    """A thread of Arrow's that lets go of a Python file while Python ends takes the whole process down (abort)."""
    path = tmp_path / "t.parquet"
    write_table({"kind": ["a"] * 9, "name": ["b"] * 9, "values": np.ones((9, 2))}, path, TABLE)

    class Place(type(path)):
        def open(self, *_arguments, **_options):
            return _Watched(self)

    assert len(read_table(Place(path))) == 9
    assert _Watched.readers == {threading.get_ident()}


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="needs a limit of the address space")
def test_a_table_is_read_where_memory_leaves_no_room_for_another_thread(tmp_path):
    """Arrow waits for ever for a thread of its own that could not be started."""
    path = tmp_path / "t.parquet"
    write_table({"kind": ["a"] * 9, "name": ["b"] * 9, "values": np.ones((9, 2))}, path, TABLE)
    code = (
        "import os, resource, sys\n"
        "from pathlib import Path\n"
        "from hrcneuro.io.tables import read_table\n"
        "pages = int(Path('/proc/self/statm').read_text().split()[0])\n"
        "most = pages * os.sysconf('SC_PAGE_SIZE') + 6 * 2**20\n"
        "resource.setrlimit(resource.RLIMIT_AS, (most, most))\n"
        "print(len(read_table(Path(sys.argv[1]))))\n"
    )
    done = subprocess.run([sys.executable, "-c", code, path], capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout == "9\n"


def test_only_what_recurs_is_written_by_a_dictionary(tmp_path):
    """A dictionary of measured values takes longer than all else, and the file grows by it."""
    types = {"kind": "category", "n": "int", "x": "float32", "wave": "float[]"}
    table = Table(1, "", {name: Column(one, "", "") for name, one in types.items()})
    data = {"kind": ["a", "b"], "n": [1, 2], "x": [0.5, 0.25], "wave": np.ones((2, 3))}
    write_table(data, tmp_path / "t.parquet", table)
    columns = pq.ParquetFile(tmp_path / "t.parquet").metadata.row_group(0)
    encodings = [columns.column(i).encodings for i in range(4)]
    assert ["RLE_DICTIONARY" in one for one in encodings] == [True, True, False, False]
