"""What is drawn over the robots of a film: plumes of actuators, trails, goals and paths."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import Any

import mujoco
import numpy as np

from fulmar_core.states.rotation import rotate

PLUMES = {
    "nozzle": (1.0, 0.72, 0.38),
    "fan": (0.62, 0.85, 1.0),
    "propeller": (0.75, 0.90, 1.0),
    "throttle": (0.75, 0.90, 1.0),
}  # by the kind of actuator
LEAST = 0.03  # share of full command below which nothing leaves an actuator
GOAL = (0.30, 0.85, 0.45)
PATH = (0.55, 0.80, 0.95)
MOST_PLACES = 24  # targets that are drawn one by one; more are a line
MOST_LINKS = 160  # of a line
Rgb = tuple[float, float, float]
_EYE = np.eye(3)


class Decor:
    """Adds shapes to a scene; what does not fit is left out."""

    def __init__(self, scene: Any) -> None:
        """Take a `MjvScene`."""
        self._scene = scene

    def plumes(self, info: Mapping[str, Any], pose: np.ndarray, shares: np.ndarray) -> None:
        """What leaves nozzles, fans and propellers, against the push."""
        reach = 0.55 * float(info.get("radius") or 0.3)
        for actuator, share in zip(info.get("actuators") or (), shares, strict=False):
            color = PLUMES.get(actuator["kind"])
            if color is None or abs(share) < LEAST or not any(actuator["direction"]):
                continue
            away = -np.sign(share) * rotate(pose[3:], np.array(actuator["direction"], dtype=float))
            begin = pose[:3] + rotate(pose[3:], np.array(actuator["position"], dtype=float))
            length = reach * (0.5 + 1.1 * min(1.0, abs(float(share))))
            turned = _along(away)
            for part, wide, opacity in ((1.0, 0.085, 0.25), (0.7, 0.055, 0.4), (0.4, 0.03, 0.85)):
                half = 0.5 * part * length
                white = 1.0 - part
                rgb = tuple(each + white * (1.0 - each) for each in color)
                size = [wide * length, wide * length, half]
                self._add(mujoco.mjtGeom.mjGEOM_ELLIPSOID, size, begin + half * away, turned, (*rgb, opacity))

    def line(self, points: np.ndarray, width: float, rgb: Rgb, *, fades: bool = False) -> None:
        """A line through points, shape (n, 3); one that fades is faint at its first point."""
        step = max(1, len(points) // MOST_LINKS)
        kept = points[::-1][::step][::-1]
        count = max(1, len(kept) - 1)
        for number, (begin, end) in enumerate(itertools.pairwise(kept)):
            opacity = 0.85 * (number + 1) / count if fades else 0.35
            geom = self._add(mujoco.mjtGeom.mjGEOM_CAPSULE, [width] * 3, begin, _EYE, (*rgb, opacity))
            if geom is not None and np.linalg.norm(end - begin) > 1e-6:
                mujoco.mjv_connector(geom, mujoco.mjtGeom.mjGEOM_CAPSULE, width, begin, end)

    def goal(
        self,
        target: np.ndarray,
        info: Mapping[str, Any],
        tolerance: float,
        ground: float | None,
        *,
        now: bool,
    ) -> None:
        """A place to reach: a disc on the floor, a ball in space; an arrow where the heading counts."""
        opacity = 0.55 if now else 0.18
        flat = ground is not None and info.get("space") in ("plane", "water")
        if flat and ground is not None:
            at = np.array([target[0], target[1], ground + 0.006])
            self._add(mujoco.mjtGeom.mjGEOM_CYLINDER, [tolerance, 0.004, 0.0], at, _EYE, (*GOAL, opacity))
        else:
            at = target[:3]
            self._add(mujoco.mjtGeom.mjGEOM_SPHERE, [tolerance] * 3, at, _EYE, (*GOAL, 0.5 * opacity))
        if (info.get("goal") or {}).get("faces") and now:
            length = max(2.5 * tolerance, 1.2 * float(info.get("radius") or 0.3))
            ahead = _along(rotate(target[3:], np.array([1.0, 0.0, 0.0])))
            size = [0.05 * length, 0.05 * length, length]
            lifted = at + np.array([0.0, 0.0, 0.03 if flat else 0.0])
            self._add(mujoco.mjtGeom.mjGEOM_ARROW, size, lifted, ahead, (*GOAL, 0.9))

    def goals(
        self, targets: Sequence[Sequence[float]], done: int, info: Mapping[str, Any], tolerance: float,
        ground: float | None,
    ) -> None:  # fmt: skip
        """The targets of a goal; those of a dense path are a line, and the one that counts is drawn on it."""
        places = np.array([each for each in targets if len(each) == 7], dtype=float).reshape(-1, 7)
        if not len(places):
            return
        moves = bool((info.get("goal") or {}).get("moves"))
        if len(places) > MOST_PLACES:
            self.line(places[:, :3], 0.02 * float(info.get("radius") or 0.3), PATH)
            return
        for number, place in enumerate(places):
            if number >= done % len(places):
                self.goal(place, info, tolerance, ground, now=number == done % len(places) and not moves)

    def _add(
        self, kind: Any, size: Sequence[float], at: np.ndarray, turned: np.ndarray, rgba: Sequence[float]
    ) -> Any:
        """Add one shape; None where the scene is full."""
        if self._scene.ngeom >= self._scene.maxgeom:
            return None
        geom = self._scene.geoms[self._scene.ngeom]
        mujoco.mjv_initGeom(
            geom, kind, np.array(size, dtype=float), np.array(at, dtype=float), turned.ravel(),
            np.array(rgba, dtype=np.float32),
        )  # fmt: skip
        geom.emission, geom.specular, geom.shininess = 0.6, 0.0, 0.0
        geom.category = mujoco.mjtCatBit.mjCAT_DECOR
        self._scene.ngeom += 1
        return geom


def _along(axis: np.ndarray) -> np.ndarray:
    """A rotation whose z is a unit vector, shape (3, 3)."""
    other = np.array([1.0, 0.0, 0.0]) if abs(axis[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
    first = np.cross(other, axis)
    first /= np.linalg.norm(first)
    return np.stack((first, np.cross(axis, first), axis), axis=1)
