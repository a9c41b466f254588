"""Recorded files of event cameras: HDF5 in the layout of DSEC, and AEDAT4 of iniVation.

DSEC (Gehrig et al., RA-L 2021, arXiv 2103.06011) has `events/x`, `y`, `t` [µs] and `p` in blocks that blosc
compresses, `t_offset` [µs], and does not say how large the camera is. AEDAT4 does. A recording may have a billion of
events: it is read block by block.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fulmar_bags.stored_bytes import UNPACK_LEAST, UNPACK_RATIO
from fulmar_core.config.errors import BagError, ConfigError
from fulmar_core.dynamics.sky.events import Events, as_polarities, joined

DSEC, AEDAT4 = (".h5", ".hdf5"), (".aedat4",)
BLOCK = 1_000_000  # events that are read at once
LONGEST_PAUSE_S = 10.0  # through a longer one no empty packets are made
US = 1_000  # [ns]
LAYOUT = "DSEC's files have events/x, y, t [µs] and p, each a row of its own, and t_offset [µs]."


@dataclass(frozen=True)
class EventFile:
    """One recording."""

    path: Path
    width: int  # of the camera [px]
    height: int  # [px]

    def packets(self, period_s: float) -> Iterator[tuple[int, Events]]:
        """End [ns] and events of packet after packet, empty ones too, from the first event on.

        Raises:
            BagError: Events are not in the order of time or lie outside of the array, or the file is damaged.
        """
        period_ns, end_ns, last_ns, held = round(1e9 * period_s), -1, -1, list[Events]()
        for block in self._blocks():
            if problem := block.problem():
                raise BagError(f"{self.path}: {problem}")
            if int(block.t[0]) < last_ns:
                raise BagError(
                    f"{self.path}: events are not in the order of time, at t = {last_ns / 1e9:.6f} s"
                )
            end_ns, last_ns = end_ns if held else int(block.t[0]) + period_ns, int(block.t[-1])
            while last_ns >= end_ns:
                first = int(np.searchsorted(block.t, np.uint64(end_ns)))
                yield end_ns, joined([*held, block[:first]])
                held, block = [], block[first:]
                paused_ns = int(block.t[0]) - end_ns
                end_ns += period_ns
                if paused_ns > 1e9 * LONGEST_PAUSE_S:
                    end_ns = int(block.t[0]) + period_ns
            held.append(block)
        if held:
            yield end_ns, joined(held)

    def _blocks(self) -> Iterator[Events]:
        """Blocks of at least one event."""
        read = _dsec if self.path.suffix in DSEC else _aedat4
        for x, y, t_ns, p in read(self.path):
            if len(t_ns):
                p = as_polarities(p)
                self._refuse_beyond(x, y, t_ns, p)
                x, y, p = x.astype(np.uint16), y.astype(np.uint16), p.astype(np.uint8)
                yield Events(x, y, t_ns.astype(np.uint64), p, self.width, self.height)

    def _refuse_beyond(self, x: np.ndarray, y: np.ndarray, t_ns: np.ndarray, p: np.ndarray) -> None:
        """Refuse numbers that an event does not have, before smaller integers wrap them around.

        Raises:
            BagError: As said.
        """
        for name, values, most in (
            ("x", x, 2**16 - 1),
            ("y", y, 2**16 - 1),
            ("t", t_ns, 2**63 - 1),
            ("p", p, 1),
        ):
            least, greatest = int(values.min()), int(values.max())
            if least < 0 or greatest > most:
                hint = ": 1 stands for brighter, 0 or -1 for darker" if name == "p" else ""
                raise BagError(
                    f"{self.path}: {name} reaches from {least} to {greatest}, must lie in 0 to {most}{hint}."
                )


def is_event_file(path: Path) -> bool:
    """Whether a path ends as recordings of event cameras do."""
    return path.suffix in (*DSEC, *AEDAT4)


def open_event_file(path: Path, size: tuple[int, int] | None = None) -> EventFile:
    """Open a recording.

    Args:
        path: Of the file.
        size: Width and height of the camera [px], for files that do not say it.

    Raises:
        BagError: There is no such file, it is none of an event camera, or it is damaged.
        ConfigError: Its camera is of another size than was given, or of none that is known.
    """
    if not path.is_file():
        raise BagError(f"{path}: there is no such file.")
    if path.suffix in DSEC:
        its = None
        next(_dsec(path), None)  # refuses what is none
    elif path.suffix in AEDAT4:
        its = _aedat4_size(path)
    else:
        raise BagError(f"{path}: recordings of event cameras end in {', '.join((*DSEC, *AEDAT4))}.")
    if its and size and its != size:
        raise ConfigError(
            f"{path}: its camera has {its[0]} × {its[1]} pixels, not {size[0]} × {size[1]}. Leave --size out."
        )
    found = its or size
    if found is None:
        raise ConfigError(
            f"{path}: files of DSEC do not say how large their camera is. Say it, as in --size 640x480."
        )
    return EventFile(path, *found)


def _dsec(path: Path) -> Iterator[tuple[np.ndarray, ...]]:
    import h5py
    import hdf5plugin  # noqa: F401 - registers blosc

    try:
        with h5py.File(path) as file:
            if isinstance(file.get("events"), h5py.Dataset):
                raise BagError(f"{path}: 'events' is one table of columns. {LAYOUT}")
            missing = [name for name in ("events/x", "events/y", "events/t", "events/p") if name not in file]
            if missing:
                raise BagError(f"{path}: '{missing[0]}' is missing. {LAYOUT}")
            parts = [file[f"events/{name}"] for name in "xytp"]
            for name, part in zip("xytp", parts, strict=True):
                _refuse_layout(path, f"events/{name}", part)
            lengths = {len(part) for part in parts}
            if len(lengths) != 1:
                raise BagError(
                    f"{path}: events/x, y, t and p have lengths {', '.join(str(len(p)) for p in parts)}."
                )
            offset_ns = US * _offset_us(path, file["t_offset"]) if "t_offset" in file else 0
            for first in range(0, max(lengths.pop(), 1), BLOCK):
                x, y, t, p = (part[first : first + BLOCK] for part in parts)
                yield x, y, US * t.astype(np.int64) + offset_ns, p
    except (OSError, RuntimeError) as error:
        raise BagError(f"{path}: cannot be read as HDF5: {error}") from error


def _refuse_layout(path: Path, name: str, part: Any) -> None:
    """Refuse what is no row of whole numbers, what stands for numbers that the file does not have, and other files.

    Raises:
        BagError: As said.
    """
    shape, kind = getattr(part, "shape", None), getattr(part, "dtype", None)
    if shape is None or len(shape) != 1 or kind is None or kind.kind not in "iub":
        found = "a group" if shape is None else f"{kind} of shape {shape}"
        seconds = " Times in seconds: multiply them by 1e6, and round." if name == "events/t" else ""
        raise BagError(f"{path}: '{name}' is {found}, must be a row of whole numbers. {LAYOUT}{seconds}")
    if part.is_virtual or part.external:
        raise BagError(f"{path}: '{name}' lies in other files, which are not opened. Copy it into this one.")
    held = part.id.get_storage_size()
    if part.nbytes > max(UNPACK_LEAST, UNPACK_RATIO * held):
        raise BagError(f"{path}: '{name}' stands for {part.nbytes} bytes, and the file holds {held} of them.")


def _offset_us(path: Path, part: Any) -> int:
    """Offset of the times [µs].

    Raises:
        BagError: It is no whole number.
    """
    value = np.asarray(part[()]) if getattr(part, "shape", None) is not None else np.zeros(0)
    if value.size != 1 or value.dtype.kind not in "iu":
        raise BagError(f"{path}: 't_offset' must be one whole number of microseconds. {LAYOUT}")
    return int(value.reshape(-1)[0])


def _aedat4(path: Path) -> Iterator[tuple[np.ndarray, ...]]:
    decoder, stream, _ = _aedat4_stream(path)
    with _aedat_errors(f"{path}: the file is damaged"):
        for packet in decoder:
            if packet["stream_id"] == stream:
                events = packet["events"]
                yield events["x"], events["y"], US * events["t"].astype(np.int64), events["on"]


@contextmanager
def _aedat_errors(what: str) -> Iterator[None]:
    """Errors of `aedat` as `BagError`; a panic of its Rust code is no `Exception`, and has no public name."""
    try:
        yield
    except BaseException as error:
        if isinstance(error, RuntimeError) or type(error).__name__ == "PanicException":
            raise BagError(f"{what}: {' '.join(str(error).split())}") from error
        raise


def _aedat4_size(path: Path) -> tuple[int, int]:
    _, _, about = _aedat4_stream(path)
    return int(about["width"]), int(about["height"])


def _aedat4_stream(path: Path) -> tuple[Any, int, dict[str, Any]]:
    """Decoder, number of the first stream of events, and what the file says of it."""
    import aedat

    with _aedat_errors(f"{path}: cannot be read as AEDAT4"):
        decoder = aedat.Decoder(str(path))
    for number, about in decoder.id_to_stream().items():
        if about["type"] == "events":
            return decoder, number, about
    raise BagError(f"{path}: it has no stream of events.")
