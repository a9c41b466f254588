"""Columns of a table that may be larger than memory, for files of NumPy."""

from __future__ import annotations

import tempfile
import zipfile
from dataclasses import dataclass, field
from types import TracebackType
from typing import Any

import numpy as np

PENDING_BYTES = 1 << 25  # that wait in memory
NUMBER_BYTES = 40  # of a number that waits, about
LETTER_BYTES = 4  # of a text, in an array


@dataclass
class _Block:
    """Rows of one column that were written together."""

    rows: int
    kind: np.dtype[Any] | None  # None: none of them has a value
    offset: int  # in the file


@dataclass
class _Column:
    waiting: list[Any] = field(default_factory=list)
    blocks: list[_Block] = field(default_factory=list)
    rows: int = 0  # in the blocks
    shape: tuple[int, ...] = ()  # of each value
    uneven: bool = False  # arrays of several lengths

    @property
    def kind(self) -> np.dtype[Any]:
        """One type for the values of all blocks."""
        kinds = {block.kind for block in self.blocks if block.kind is not None}
        absent = any(block.kind is None for block in self.blocks)
        texts = any(kind.kind == "U" for kind in kinds)
        return np.result_type(*kinds, *([np.float64] if absent and not texts else []))


class ColumnStore:
    """Rows that are added one by one, and come out as one array for each column; kept in a file without a name."""

    def __init__(self) -> None:
        """Begin without a row."""
        self.count = 0
        self._columns: dict[str, _Column] = {}
        self._bytes = 0
        self._spool = tempfile.TemporaryFile()  # noqa: SIM115 - closed by `__exit__`

    def __enter__(self) -> ColumnStore:
        """It is."""
        return self

    def __exit__(
        self, _type: type | None, _error: BaseException | None, _trace: TracebackType | None
    ) -> None:
        """Forget everything."""
        self._spool.close()

    def add(self, row: dict[str, Any]) -> None:
        """Add a row: numbers, texts and arrays; what it lacks is NaN, or an empty text."""
        for name, value in row.items():
            column = self._columns.setdefault(name, _Column())
            column.waiting += [None] * (self.count - column.rows - len(column.waiting))
            column.waiting.append(value)
            self._bytes += getattr(value, "nbytes", NUMBER_BYTES)
            self._bytes += LETTER_BYTES * len(value) if isinstance(value, str) else 0
        self.count += 1
        if self._bytes > PENDING_BYTES:
            self._flush()

    def write(self, archive: zipfile.ZipFile, prefix: str) -> list[str]:
        """Write each column as `<prefix>/<name>.npy`; returns those of arrays whose lengths differ, which have none."""
        self._flush()
        for name, column in self._columns.items():
            if column.uneven:
                continue
            kind, shape = column.kind, column.shape
            header = {
                "descr": np.lib.format.dtype_to_descr(kind),
                "fortran_order": False,
                "shape": (self.count, *shape),
            }
            with archive.open(f"{prefix}/{name}.npy", "w", force_zip64=True) as stream:
                np.lib.format.write_array_header_1_0(stream, header)
                for block in column.blocks:
                    stream.write(self._values(block, kind, shape).astype(kind).tobytes())
        return [name for name, column in self._columns.items() if column.uneven]

    def _values(self, block: _Block, kind: np.dtype[Any], shape: tuple[int, ...]) -> np.ndarray:
        if block.kind is None:
            return np.full(block.rows, "" if kind.kind == "U" else np.nan)
        self._spool.seek(block.offset)
        found = self._spool.read(block.rows * block.kind.itemsize * int(np.prod(shape, dtype=int)))
        return np.frombuffer(found, dtype=block.kind).reshape(block.rows, *shape)

    def _flush(self) -> None:
        for column in self._columns.values():
            values = column.waiting + [None] * (self.count - column.rows - len(column.waiting))
            column.waiting, column.rows = [], self.count
            shapes = {np.shape(value) for value in values} | ({column.shape} if column.blocks else set())
            column.uneven = column.uneven or len(shapes) > 1
            if not values or column.uneven:
                continue
            kind = None
            offset = self._spool.seek(0, 2)
            if any(value is not None for value in values):
                block = _array(values)
                kind = block.dtype
                self._spool.write(block.tobytes())
            column.shape = next(iter(shapes))
            column.blocks.append(_Block(len(values), kind, offset))
        self._bytes = 0


def _array(values: list[Any]) -> np.ndarray:
    if isinstance(values[0], np.ndarray):
        return np.stack(values)
    if any(isinstance(value, str) for value in values):
        return np.array(["" if value is None else str(value) for value in values])
    return np.array([np.nan if value is None else value for value in values])
