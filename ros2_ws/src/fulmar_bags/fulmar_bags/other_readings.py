"""What is measured and estimated in a run beside motion and commands: wheels, air data, gyroscope, inertia."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fulmar_bags.decode import NS, stamp_of, stamps_ns
from fulmar_bags.wire_reader import WireReader
from fulmar_core.robots.topics import IMU, INERTIA, INERTIA_COVARIANCE, SENSOR_WIRES, Wire

MOMENTS = ("xx", "yy", "zz", "xy", "xz", "yz")  # of an inertia, in the order of its covariance


@dataclass(frozen=True)
class Series:
    """Named numbers over time."""

    stamp_s: np.ndarray  # (n,) [s]
    names: tuple[str, ...]  # of the columns
    values: np.ndarray  # (n, m)

    def __len__(self) -> int:
        """Number of samples."""
        return len(self.stamp_s)


@dataclass(frozen=True)
class Pressures:
    """Measured pressure of the gas supply over time."""

    stamp_s: np.ndarray  # (n,) [s]
    pascal: np.ndarray  # (n,) absolute [Pa]

    def __len__(self) -> int:
        """Number of samples."""
        return len(self.stamp_s)


@dataclass(frozen=True)
class Inertias:
    """Estimates of a satellite's inertia over time."""

    stamp_s: np.ndarray  # (n,) [s]
    tensor: np.ndarray  # (n, 6) in the order of `MOMENTS` [kg·m²]
    std: np.ndarray  # (n, 6) standard deviations, NaN where none came with an estimate [kg·m²]

    def __len__(self) -> int:
        """Number of estimates."""
        return len(self.stamp_s)


NO_SERIES = Series(np.zeros(0), (), np.zeros((0, 0)))
NO_PRESSURES = Pressures(np.zeros(0), np.zeros(0))
NO_INERTIAS = Inertias(np.zeros(0), np.zeros((0, 6)), np.zeros((0, 6)))


def series(reader: WireReader, wire: Wire, field: str) -> Series:
    """A wire of JointState messages; `field` is the one that has its numbers."""
    found = reader.vectors(wire, field)
    return Series(found.stamp_ns / NS, found.names, found.values)


def pressures_of(reader: WireReader) -> Pressures:
    """Readings of the gauge of the gas supply."""
    received = reader.received(SENSOR_WIRES["supply"], lambda message, _: (message.fluid_pressure, ""))
    return Pressures(
        np.array([each.stamp_ns / NS for each in received]),
        np.array([each.value for each in received], dtype=float),
    )


def gyroscope_s(reader: WireReader) -> tuple[float, ...]:
    """Stamps of the inertial unit of a satellite, which is what has reaction wheels [s]."""
    stamps = stamps_ns(reader.bag.of(IMU)) if len(reader.bag.of(SENSOR_WIRES["wheels"])) else None
    return () if stamps is None else tuple((stamps / NS).tolist())


def inertias(reader: WireReader) -> Inertias:
    """Estimates of the inertia, each with the spread that was recorded after it and before the next."""
    found = reader.messages(INERTIA)
    if not found:
        return NO_INERTIAS
    spreads = [(log_ns, np.array(each.data)) for log_ns, each in reader.messages(INERTIA_COVARIANCE)]
    begins, std = [log_ns for log_ns, _ in found], np.full((len(found), len(MOMENTS)), np.nan)
    for log_ns, covariance in spreads:
        index = int(np.searchsorted(begins, log_ns, side="right")) - 1
        if index >= 0 and covariance.size == len(MOMENTS) ** 2:
            std[index] = np.sqrt(np.diag(covariance.reshape(len(MOMENTS), -1)).clip(0.0))
    tensor = [[getattr(each.inertia, f"i{name}") for name in MOMENTS] for _, each in found]
    return Inertias(np.array([stamp_of(each) / NS for _, each in found]), np.array(tensor, dtype=float), std)
