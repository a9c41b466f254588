"""Simulated event camera that looks at the stars.

A pixel reports an event whenever the logarithm of its brightness has moved by a threshold since its last one (Gallego
et al., "Event-based Vision: A Survey", TPAMI 2022, §2.1). Only pixels near stars change: they are followed in steps of
a quarter of a pixel of motion, everything else is background noise, drawn at once.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.spatial.transform import Rotation

from fulmar_core.dynamics.sky.events import Events, events_of
from fulmar_core.robots.sensors.catalogue import Stars
from fulmar_core.robots.sensors.event_camera import EventSensorSpec
from fulmar_core.robots.sensors.sampling import sensor_rng
from fulmar_core.robots.sensors.star_camera import StarCamera

STEP_PX = 0.25  # of motion
FAINT = 0.05  # share of the background below which the light of a star is left out
LAG_PX = 2  # beyond that, for pixels that settle after a star has left


class EventSensor:
    """One camera, in one episode after another; pixels remember between exposures."""

    def __init__(
        self, camera: StarCamera, spec: EventSensorSpec, stars: Stars, *, name: str = "events"
    ) -> None:
        """Prepare; `name` gives it random numbers of its own."""
        self.camera, self._spec, self._stars, self._name = camera, spec, stars, name
        self.reset(0, 0)

    def reset(self, seed: int, number: int) -> None:
        """Begin episode `number` of a seed, with pixels that differ from one another."""
        camera, spec = self.camera, self._spec
        self._rng = rng = sensor_rng(seed, number, self._name)
        size = camera.width * camera.height
        least = 0.2 * spec.threshold
        self._up, self._down = (
            np.maximum(
                spec.threshold + spec.threshold_std * rng.standard_normal(size, dtype=np.float32), least
            )
            for _ in range(2)
        )
        self._hot = rng.integers(0, size, spec.hot_pixels)
        dark = np.float32(math.log(spec.background))
        self._memory, self._level = np.full(size, dark), np.full(size, dark)
        self._last_s = np.full(size, -np.inf)
        self._light = np.full(
            size, spec.background
        )  # zero of the light is the background; only touched near stars
        self._begun = False

    def expose(self, quat_xyzw: np.ndarray, rate: np.ndarray, start_ns: int, duration_ns: int) -> Events:
        """Watch the sky while the body turns at a constant rate.

        Args:
            quat_xyzw: Attitude of the body in the world when the exposure begins.
            rate: Turn rate about the body's axes [rad/s].
            start_ns: When it begins [ns].
            duration_ns: How long it lasts, > 0 [ns].

        Returns:
            Its events.
        """
        seconds, camera = duration_ns / 1e9, self.camera
        spare = math.degrees(float(np.linalg.norm(rate))) * seconds
        near = camera.near(self._stars, camera.axes_in_world(quat_xyzw), spare_deg=spare + 0.1)
        field = float(np.hypot(camera.width, camera.height)) / (2.0 * camera.focal_px)
        fastest = camera.focal_px * float(np.linalg.norm(rate)) * (1.0 + field**2)
        steps = max(1, math.ceil(fastest * seconds / STEP_PX))
        dt = seconds / steps
        places = self._places(near, quat_xyzw, rate, dt, steps)
        flux = camera.flux(near.magnitudes)
        reach = self._reaches(flux)
        if not self._begun:
            self._settle(places[0], flux, reach)
        found: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []  # pixel, time [s], polarity
        for step in range(steps):
            self._step(places[step + 1], flux, reach, step * dt, dt, found)
        self._last_s -= seconds
        return self._packet(found, seconds, start_ns)

    def _places(self, near: Stars, quat: np.ndarray, rate: np.ndarray, dt: float, steps: int) -> np.ndarray:
        """Where stars are after each step, shape (steps + 1, n, 2) [px]."""
        turned = Rotation.from_rotvec(np.arange(steps + 1)[:, None] * dt * np.asarray(rate)[None])
        axes = (Rotation.from_quat(quat) * turned).as_matrix() @ self.camera.to_body
        x, y, z = np.moveaxis(near.directions @ axes, -1, 0)
        camera = self.camera
        middle = np.array([0.5 * (camera.width - 1), 0.5 * (camera.height - 1)])
        return np.asarray(np.stack((x / z, y / z), axis=-1) * camera.focal_px + middle)

    def _reaches(self, flux: np.ndarray) -> np.ndarray:
        """Half of the side of the patch around each star, which bright ones need larger, shape (n,) [px]."""
        ratio = np.maximum(flux / (FAINT * self._spec.background), 2.0)
        return np.ceil(self.camera.psf_px * np.sqrt(2.0 * np.log(ratio))).astype(int) + LAG_PX

    def _seen(self, places: np.ndarray, flux: np.ndarray, reach: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Pixels near stars, each once, and the logarithm of their brightness."""
        pixels = [
            self._lit(places[reach == each], flux[reach == each], int(each)) for each in np.unique(reach)
        ]
        pixel = np.unique(np.concatenate(pixels)) if pixels else np.zeros(0, dtype=int)
        level = np.log(self._light[pixel])
        self._light[pixel] = self._spec.background
        return pixel, level

    def _lit(self, places: np.ndarray, flux: np.ndarray, reach: int) -> np.ndarray:
        """Add the light of stars with patches of one size to the image; returns the pixels."""
        camera = self.camera
        inside = camera.is_inside(places, reach)
        places, flux = places[inside], flux[inside]
        offsets = np.arange(-reach, reach + 1)
        middle = np.rint(places).astype(int)
        columns, rows = middle[:, :1] + offsets, middle[:, 1:] + offsets  # (n, side)
        width = -0.5 / camera.psf_px**2
        across = np.exp(width * (columns - places[:, :1]) ** 2)
        down = np.exp(width * (rows - places[:, 1:]) ** 2) * flux[:, None]
        light = down[:, :, None] * across[:, None, :]
        pixel = rows[:, :, None] * camera.width + columns[:, None, :]
        there = ((rows >= 0) & (rows < camera.height))[:, :, None] & (
            (columns >= 0) & (columns < camera.width)
        )[:, None]
        pixel, light = pixel[there], light[there]
        np.add.at(self._light, pixel, light)
        return np.asarray(pixel)

    def _settle(self, places: np.ndarray, flux: np.ndarray, reach: np.ndarray) -> None:
        """Let pixels have seen the first image for long; their last events are anywhere below their thresholds."""
        pixel, level = self._seen(places, flux, reach)
        self._level[pixel] = level
        size = len(self._memory)
        self._memory = self._level + (self._rng.random(size, dtype=np.float32) - 0.5) * self._spec.threshold
        self._begun = True

    def _step(
        self,
        places: np.ndarray,
        flux: np.ndarray,
        reach: np.ndarray,
        begin_s: float,
        dt: float,
        found: list[tuple[np.ndarray, np.ndarray, np.ndarray]],
    ) -> None:
        pixel, wanted = self._seen(places, flux, reach)
        before = self._level[pixel]
        hz = self._spec.bandwidth_hz
        share = 1.0 - math.exp(-2.0 * math.pi * hz * dt) if hz else 1.0
        after = before + share * (wanted - before)
        self._level[pixel] = after
        memory = self._memory[pixel]
        change = after - memory
        up, down = self._up[pixel], self._down[pixel]
        count = np.where(change > 0.0, np.floor(change / up), -np.floor(-change / down)).astype(int)
        which = np.flatnonzero(count)
        if not len(which):
            return
        pixel, count, before, after = pixel[which], count[which], before[which], after[which]
        memory, size = memory[which], np.where(count > 0, up[which], -down[which])
        slope = after - before
        slope = np.where(np.abs(slope) < 1e-12, np.where(slope < 0.0, -1e-12, 1e-12), slope)
        for j in range(1, int(np.abs(count).max()) + 1):
            some = np.abs(count) >= j
            level = memory[some] + j * size[some]
            when = begin_s + dt * np.clip((level - before[some]) / slope[some], 0.0, 1.0)
            awake = when - self._last_s[pixel[some]] >= self._spec.refractory_s
            chosen = pixel[some][awake]
            self._last_s[chosen] = when[awake]
            found.append((chosen, when[awake], (count[some][awake] > 0).astype(np.uint8)))
        self._memory[pixel] = memory + np.abs(count) * size

    def _packet(
        self, found: list[tuple[np.ndarray, np.ndarray, np.ndarray]], seconds: float, start_ns: int
    ) -> Events:
        """Events of the stars with noise, sorted."""
        spec, camera, rng = self._spec, self.camera, self._rng
        pixels, times, polarities = ([each[i] for each in found] for i in range(3))
        for count, where in (
            (rng.poisson(spec.noise_hz * camera.width * camera.height * seconds), None),
            (rng.poisson(spec.hot_hz * len(self._hot) * seconds) if len(self._hot) else 0, self._hot),
        ):
            size = camera.width * camera.height
            drawn = (
                rng.integers(0, size, count) if where is None else where[rng.integers(0, len(where), count)]
            )
            pixels.append(drawn)
            times.append(rng.uniform(0.0, seconds, count))
            polarities.append(rng.integers(0, 2, count).astype(np.uint8))
        pixel, when, polarity = (
            np.concatenate(pixels).astype(int),
            np.concatenate(times),
            np.concatenate(polarities),
        )
        when = np.clip(when + spec.jitter_s * rng.standard_normal(len(when)), 0.0, None)
        stamps = start_ns + np.rint(1e9 * when).astype(np.int64)
        return events_of(
            pixel % camera.width, pixel // camera.width, stamps, polarity, camera.width, camera.height
        )
