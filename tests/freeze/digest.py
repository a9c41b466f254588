"""Digests of numbers, whatever holds them; names of classes and modules do not count."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

LENGTH = 16  # of the hexadecimal digits of a SHA-256 that are kept


def digest(value: Any) -> str:
    """The first digits of the SHA-256 of everything in a value, to the last bit."""
    found = hashlib.sha256()
    for part in _parts(value):
        found.update(part)
    return found.hexdigest()[:LENGTH]


def _parts(value: Any) -> Iterator[bytes]:
    if is_dataclass(value) and not isinstance(value, type):
        for field in fields(value):
            if field.name.startswith("_"):
                continue  # how it lies in memory
            yield field.name.encode()
            yield from _parts(getattr(value, field.name))
    elif isinstance(value, Mapping):
        for key in sorted(value, key=str):
            yield str(key).encode()
            yield from _parts(value[key])
    elif isinstance(value, (tuple, list)):
        yield f"[{len(value)}]".encode()
        for each in value:
            yield from _parts(each)
    elif isinstance(value, (np.ndarray, np.generic)):
        array = np.ascontiguousarray(value)
        yield f"{array.dtype.str}{array.shape}".encode()
        yield array.tobytes()
    elif isinstance(value, bytes):
        yield value
    elif value is None or isinstance(value, (bool, int, float, str)):
        yield json.dumps(value).encode()
    else:
        raise TypeError(f"a digest takes numbers and texts, not {type(value).__name__}")
