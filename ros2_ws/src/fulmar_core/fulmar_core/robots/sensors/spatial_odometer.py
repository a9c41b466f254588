"""Pose and velocity of a body in space as an odometry source reports them."""

from __future__ import annotations

from typing import Any

import numpy as np
from array_api_compat import device

from fulmar_core.robots.sensors.odometer import Channel, Drawn, Odometer, OdometrySpec
from fulmar_core.states.arrays import array_namespace, clip, is_numpy
from fulmar_core.states.attitude import exponential, normalised, product
from fulmar_core.states.counter_rng import uniform_from
from fulmar_core.states.rotation import Array
from fulmar_core.states.spatial import SpatialState

SENSED = 12  # errors: three each of place, attitude, velocity and turn rate
PLACE, ATTITUDE, MOTION = slice(0, 3), slice(3, 6), slice(6, SENSED)  # errors
LOST = SENSED  # which random word says whether a measurement is lost


class SpatialOdometer(Odometer[SpatialState]):
    """As `Odometer`, with errors of the attitude as small rotations about the body's axes.

    The robot's `heading` and `yaw_rate` channels hold for each axis. An attitude has no scale, limit or quantum.
    """

    LOST = LOST
    WORDS, BLURRED_WORDS = SENSED + 1, SENSED + 7

    @staticmethod
    def channels(spec: OdometrySpec) -> tuple[Channel, ...]:
        """Of three axes each of place, attitude, velocity and turn rate."""
        each = (spec.position, spec.heading, spec.velocity, spec.yaw_rate)
        return tuple(channel for channel in each for _ in range(3))

    def _disturbed(self, columns: Array, world: Any, drawn: Drawn) -> Array:
        """Columns, shape (13, n), with the errors that worlds (`SpatialWorld`) have, and with random ones."""
        xp = array_namespace(columns)
        error = self._errors(columns, world, drawn)
        turned = normalised(product(_each(columns[3:7]), exponential(_each(error[ATTITUDE]))))
        linear = xp.concat((columns[0:3], columns[7:13]), axis=0)
        if "scale_std" in self._used:
            scale = self._constant("scale_std", columns) * world.sensor_scale
            linear = linear * (1.0 + xp.concat((scale[PLACE], scale[MOTION]), axis=0))
        linear = linear + xp.concat((error[PLACE], error[MOTION]), axis=0)
        if "limit" in self._used:
            most = self._most(columns)
            most = xp.concat((most[PLACE], most[MOTION]), axis=0)
            linear = clip(linear, -most, most)
        if "quantum" in self._used:
            quantum = self._constant("quantum", columns)
            quantum = xp.concat((quantum[PLACE], quantum[MOTION]), axis=0)
            step = xp.where(quantum > 0.0, quantum, xp.ones_like(quantum))
            linear = xp.where(quantum > 0.0, xp.round(linear / step) * step, linear)
        attitude = np.array([turned]).T if isinstance(turned[0], float) else xp.stack(turned)
        return xp.concat((linear[0:3], attitude, linear[3:9]), axis=0)

    def _errors(self, columns: Array, world: Any, drawn: Drawn) -> Array:
        """Bias, noise and blur of each channel, shape (12, n)."""
        xp = array_namespace(columns)
        error = xp.zeros((SENSED, columns.shape[1]), dtype=columns.dtype, device=device(columns))
        if "bias_std" in self._used:
            error = error + self._constant("bias_std", columns) * world.sensor_bias
        if "std" in self._used:
            noise = drawn.normal * world.noise
            error = error + self._constant("std", columns) * noise
        if self._blurred:
            share = 2.0 * uniform_from(drawn.bits[SENSED + 1 : SENSED + 7], columns.dtype) - 1.0
            blur = xp.concat((share[:3] * world.velocity_noise, share[3:] * world.rate_noise), axis=0)
            error = xp.concat((error[:6], error[6:] + blur), axis=0)
        return error


def _each(rows: Array) -> tuple[Array, ...]:
    """Rows one by one; of a lone world as plain numbers, with which formulas of attitudes take a tenth of the time."""
    lone = rows.shape[1] == 1 and is_numpy(rows) and rows.dtype == np.float64
    return tuple(rows[:, 0].tolist()) if lone else tuple(rows)
