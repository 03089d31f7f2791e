"""Parquet artifacts: every table declares its columns, their units and what they mean, and the file carries them."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from hrcneuro.errors import DataError

_TYPES = {
    "category": pa.dictionary(pa.int32(), pa.string()),
    "string": pa.string(),
    "bool": pa.bool_(),
    "int": pa.int64(),
    "float": pa.float64(),
    "float32": pa.float32(),
}


@dataclass(frozen=True)
class Column:
    """One column: type (``category string bool int float float32``, with ``[]`` a fixed-size list), unit, meaning."""

    type: str
    unit: str
    text: str


@dataclass(frozen=True)
class Table:
    """A table's schema: version, a line on what a row is, and the columns in their order."""

    version: int
    row: str
    columns: Mapping[str, Column]


def write_table(data: pd.DataFrame | Mapping[str, Any], path: Path, table: Table) -> None:
    """Write a Parquet file with exactly the declared columns; a 2-D array fills a list column.

    Raises:
        ValueError: Columns are missing, unknown or of another type than declared (a mistake in a stage).
    """
    names = list(data.columns) if isinstance(data, pd.DataFrame) else list(data)
    if set(names) != set(table.columns):
        missing, extra = sorted(set(table.columns) - set(names)), sorted(set(names) - set(table.columns))
        raise ValueError(f"{path.name}: columns missing {missing}, not declared {extra}")
    arrays = [_array(data[name], column) for name, column in table.columns.items()]
    fields = [
        pa.field(name, array.type, metadata={"unit": column.unit, "description": column.text})
        for array, (name, column) in zip(arrays, table.columns.items(), strict=True)
    ]
    meta = {"hrcneuro": json.dumps({"version": table.version, "row": table.row})}
    # Measured values hardly recur: a dictionary of them takes longer to make than all else, and the file grows by it.
    recurring = [name for name, column in table.columns.items() if not column.type.startswith("float")]
    whole = pa.Table.from_arrays(arrays, schema=pa.schema(fields, metadata=meta))
    # Opened here: Arrow takes no path with a byte that is not UTF-8.
    with path.open("wb") as file:
        pq.write_table(whole, file, compression="zstd", use_dictionary=recurring)


def read_table(path: Path, columns: list[str] | None = None) -> pd.DataFrame:
    """Return a Parquet artifact, or some of its columns, as a data frame.

    Enumerations come back as plain strings, lists as arrays.

    Raises:
        DataError: The file is missing or unreadable.
    """
    table = _read(path, columns)
    plain = [
        table.column(i).cast(pa.string()) if pa.types.is_dictionary(field.type) else table.column(i)
        for i, field in enumerate(table.schema)
    ]
    return pa.Table.from_arrays(plain, names=table.column_names).to_pandas(use_threads=False)


def read_lists(path: Path, column: str) -> np.ndarray:
    """Return a fixed-size list column as an array, shape (rows, length).

    Raises:
        DataError: The file is missing or unreadable.
    """
    chunks = _read(path, [column]).column(column)
    if not len(chunks):
        return np.zeros((0, 0))
    flat = chunks.combine_chunks()
    return flat.flatten().to_numpy(zero_copy_only=False).reshape(len(flat), -1)


def describe(path: Path) -> Table:
    """Return the schema that a Parquet artifact carries.

    Raises:
        DataError: The file is missing, unreadable or not written by hrcneuro.
    """
    try:
        with path.open("rb") as file:
            schema = pq.read_schema(file)
        head = json.loads(schema.metadata[b"hrcneuro"])
    except (OSError, pa.ArrowInvalid, KeyError, TypeError) as error:
        raise DataError(f"{path.name} is no hrcneuro table: {error}", cure="rerun the stage that writes it") from error
    columns = {
        f.name: Column(str(f.type), f.metadata[b"unit"].decode(), f.metadata[b"description"].decode()) for f in schema
    }
    return Table(head["version"], head["row"], columns)


def _read(path: Path, columns: list[str] | None = None) -> pa.Table:
    try:
        # Into memory of Arrow's own, as it takes no path that is not UTF-8. Without threads of its own: where memory is
        # limited none can be started, and Arrow waits for it for ever.
        with path.open("rb") as file:
            content = pa.allocate_buffer(os.fstat(file.fileno()).st_size)
            file.readinto(memoryview(content))
        table = pq.ParquetFile(pa.BufferReader(content)).read(columns=columns, use_threads=False)
        return table if columns is None else table.select(columns)
    except (OSError, KeyError, pa.ArrowInvalid) as error:
        raise DataError(
            f"{path.name} cannot be read as Parquet: {error}",
            cure="it is truncated or damaged: rerun the stage that writes it with --force",
        ) from error


def _array(values: Any, column: Column) -> pa.Array:
    base = _TYPES[column.type.removesuffix("[]")]
    if column.type.endswith("[]"):
        whole = isinstance(values, np.ndarray) and values.ndim == 2
        block = values if whole else np.stack(list(values)) if len(values) else np.zeros((0, 1))
        block = np.ascontiguousarray(block)
        return pa.FixedSizeListArray.from_arrays(pa.array(block.ravel(), type=base), block.shape[1])
    series = pd.Series(values) if not isinstance(values, pd.Series) else values
    if isinstance(series.dtype, pd.CategoricalDtype):
        series = series.astype(object)
    if column.type in ("category", "string"):
        # Each value is looked at once, however many rows have it; what is missing, None or NaN, gets the code -1.
        codes, values = pd.factorize(series)
        strings = pa.array([str(v) for v in values], type=pa.string()).take(pa.array(codes, mask=codes < 0))
        return strings.dictionary_encode() if column.type == "category" else strings
    if column.type == "float" or column.type == "float32":
        # A number that does not exist is null, not NaN: other readers average over NaN without a word.
        return pa.array(series.to_numpy(dtype=float, na_value=np.nan), type=base, from_pandas=True)
    return pa.array(series, type=base, from_pandas=True)
