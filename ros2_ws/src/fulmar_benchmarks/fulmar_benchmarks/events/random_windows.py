"""One window of events at a random attitude and rate, and what the estimators make of it."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from fulmar_core.dynamics.sky.event_sensor import EventSensor
from fulmar_core.dynamics.sky.events import Events
from fulmar_core.estimators.event_rate.contrast import RateFit, fit_rate
from fulmar_core.estimators.event_rate.local_flow import local_flow, rate_of_flow
from fulmar_core.estimators.event_rate.star_tracks import find_tracks
from fulmar_core.robots.sensors.catalogue import load_stars
from fulmar_core.robots.sensors.event_camera import EventSensorSpec
from fulmar_core.robots.sensors.star_camera import StarCamera

TURNED = (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))  # the second camera: by 90° about the first one's x axis


@dataclass(frozen=True)
class Conditions:
    """What a window is made with; the defaults are those of thesis Table 6.2, as far as they are known."""

    camera: StarCamera = StarCamera()
    pixels: EventSensorSpec = EventSensorSpec()
    window_s: float = 0.2
    slowest_deg: float = 0.1  # of the rates that are drawn [deg/s]
    fastest_deg: float = 2.0  # [deg/s]
    cameras: int = 2  # one, or two


def measure_window(conditions: Conditions, seed: int, number: int) -> dict[str, Any]:
    """Draw an attitude and a rate, watch the sky, and estimate; no search begins at the truth.

    Args:
        conditions: Cameras, pixels and rates.
        seed: Of all draws.
        number: Of the window.

    Returns:
        JSON-ready: `rate` [deg/s]; of `single`, `dual`, `flow` (local flow of the first camera) and `fused` (the rule
        of thesis §6.4.5) the `error` [deg/s], of the first two the `nees`; `stars`, `events_per_s`, `cpu_s` of the
        dual estimate, and `sky_s`, the time that a second of one camera's sky takes.
    """
    rng = np.random.default_rng((seed, number, 6_4))
    quat = Rotation.random(random_state=int(rng.integers(1 << 31))).as_quat()
    axis = rng.standard_normal(3)
    size = math.radians(rng.uniform(conditions.slowest_deg, conditions.fastest_deg))
    rate = size * axis / np.linalg.norm(axis)
    first = conditions.camera
    second = StarCamera(**{**first.__dict__, "mounting": TURNED})
    began = time.process_time()
    cameras = (first, second)[: conditions.cameras]
    packets = [
        _watch(each, conditions, quat, rate, seed, number, name)
        for each, name in zip(cameras, "ab", strict=False)
    ]
    sky_s = (time.process_time() - began) / (2.0 * len(cameras) * conditions.window_s)
    length_ns = round(1e9 * conditions.window_s)
    began = time.process_time()
    tracks = [find_tracks(events, 0, length_ns) for events in packets]
    together = fit_rate(tracks, cameras)
    cpu_s = time.process_time() - began
    alone = [fit_rate([one], [camera]) for one, camera in zip(tracks, cameras, strict=True)]
    found: dict[str, Any] = {
        "rate": np.degrees(rate).tolist(),
        "stars": [one.count for one in tracks],
        "events_per_s": float(np.mean([len(events) for events in packets]) / conditions.window_s),
        "cpu_s": cpu_s,
        "sky_s": sky_s,
        "single": _error(alone[0], rate),
        "dual": _error(together, rate) if len(cameras) > 1 else None,
    }
    if tracks[0].count:
        flow = rate_of_flow(local_flow(tracks[0]), first)[0]
        found["flow"] = {"error": np.degrees(first.to_body @ flow - rate).tolist()}
    if len(alone) > 1 and alone[0] is not None and alone[1] is not None:
        one, other = alone[0].rate, alone[1].rate
        fused = np.array([0.5 * (one[0] + other[0]), one[1], other[2]])
        found["fused"] = {"error": np.degrees(fused - rate).tolist()}
    return found


def _watch(
    camera: StarCamera,
    conditions: Conditions,
    quat: np.ndarray,
    rate: np.ndarray,
    seed: int,
    number: int,
    name: str,
) -> Events:
    """Events of a window, of pixels that have watched for as long before it."""
    sensor = EventSensor(camera, conditions.pixels, load_stars(), name=name)
    sensor.reset(seed, number)
    seconds, length_ns = conditions.window_s, round(1e9 * conditions.window_s)
    before = (Rotation.from_quat(quat) * Rotation.from_rotvec(-seconds * rate)).as_quat()
    sensor.expose(before, rate, 0, length_ns)
    return sensor.expose(quat, rate, 0, length_ns)


def _error(fit: RateFit | None, rate: np.ndarray) -> dict[str, Any] | None:
    if fit is None:
        return None
    error = fit.rate - rate
    return {
        "error": np.degrees(error).tolist(),
        "nees": float(error @ np.linalg.pinv(fit.covariance, hermitian=True) @ error),
    }
