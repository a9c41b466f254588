"""The benchmark of descents as lines of text."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from fulmar_benchmarks.descent.campaign import WAYS, words, written


def print_tables(document: dict[str, Any], write: Callable[[str], None]) -> None:
    """Print every flight, then the figures of each height and way, then what is required."""
    write(f"{document['robot']} by {document['controller']}, {document['scenario']}, seed {document['seed']}")
    for row in document["heights"]:
        for way in (way for way in WAYS if way in row):
            for each in row[way]["each"]:
                write(
                    f"  {way:8} {row['height_m']:g} m, flight {each['number']:3}: bank {each['bank_deg']:5.2f} deg, "
                    f"sink {written(each['sink_m_s'])} m/s after {each['seconds']:.1f} s"
                )
            for sentence in row[way]["not_flown"]:
                write(f"  {way:8} {row['height_m']:g} m, {sentence}")
    for row in document["heights"]:
        for way in (way for way in WAYS if way in row):
            write(words(row, way))
    for line in document["required"]:
        write(
            f"{'met' if line['passed'] else 'NOT MET':8} {line['what']}: {line['good']} of {line['flights']} "
            f"(limit {line['limit']:.4f} of them)"
        )
