"""Continuous turbulence after Dryden, MIL-F-8785C: gusts along and about the axes of an aircraft.

White noise passes filters whose output has the specified spectra. They are stepped exactly: the standard deviations are
those of the specification at every time step, from the first step on. Forms: H_u of first order, H_v and H_w of second,
H_p of first, and q and r as the slopes of w and v over the span. Lengths and intensities are those of low altitude, up
to 1,000 ft; above it intensities stay, and lengths grow to 1,750 ft at 2,000 ft.
"""

from __future__ import annotations

import math

from fulmar_core.states.arrays import array_namespace, clip
from fulmar_core.states.counter_rng import normal_from, words
from fulmar_core.states.rotation import Array

FOOT = 0.3048  # [m]
LOWEST, LOW, HIGH = 1.0, 1000.0, 2000.0  # heights that count, and ends of the low and the middle model [ft]
LONGEST = 1750.0  # length of turbulence at high altitude [ft]
FILTERS = 8  # numbers that gusts remember: u, two each of v and w, p, and two low-pass filters
NORMALS = 6  # random numbers of a step
SETTLED = 40.0  # time constants after which nothing is left of a filter's past [-]
CLASSES = {"light": 7.7, "moderate": 15.4, "severe": 23.1}  # wind at 20 ft: 15, 30 and 45 kt [m/s]

Gust = tuple[
    Array, Array, Array, Array, Array, Array
]  # u, v, w [m/s], p, q, r [rad/s]: x ahead, y right, z down


def lengths_and_intensities(height: Array, wind_at_20_ft: Array) -> tuple[Array, Array, Array, Array]:
    """L_u = L_v and L_w [m], σ_u = σ_v and σ_w [m/s], shapes (...,).

    Args:
        height: Above the ground, shape (...,) [m].
        wind_at_20_ft: Shape (...,) [m/s]; see `CLASSES`.
    """
    xp = array_namespace(height)
    feet = clip(height / FOOT, LOWEST, HIGH)
    low = clip(feet, LOWEST, LOW)
    base = 0.177 + 0.000823 * low
    share = xp.exp(-0.4 * xp.log(base))
    above = (feet - low) / (HIGH - LOW)  # 0 up to the end of the low model
    along = low * share * share * share
    along, down = along + above * (LONGEST - along), low + above * (LONGEST - low)
    sigma = 0.1 * wind_at_20_ft
    return FOOT * along, FOOT * down, sigma * share, sigma


def gust_step(
    filters: Array,
    keys: Array,
    steps: Array,
    *,
    airspeed: Array,
    height: Array,
    wind: Array,
    span: float,
    dt: float,
) -> tuple[Array, Gust]:
    """Let the air move past for a time step.

    Args:
        filters: Memory, shape (FILTERS, n); any where `steps` is 0.
        keys: Whole numbers that the noise of each world hangs on, shape (2, n).
        steps: Steps that each has made, whole numbers, shape (n,).
        airspeed: Shape (n,) [m/s].
        height: Above the ground, shape (n,) [m].
        wind: At 20 ft, shape (n,) [m/s].
        span: Of the wing [m].
        dt: Time step [s].

    Returns:
        The filters after it, and the gust: how the air moves and turns in the aircraft's axes.
    """
    xp = array_namespace(airspeed)
    noise = normal_from(words((keys[0], keys[1]), steps, NORMALS), airspeed.dtype)
    fresh = steps == 0
    speed = clip(airspeed, 1.0, None)
    along, down, sigma_u, sigma_w = lengths_and_intensities(height, wind)

    def passed(constant: Array) -> Array:
        """Time step in time constants, endless for the first one."""
        return xp.where(fresh, xp.full_like(speed, SETTLED), dt / constant)

    d_u, d_w = passed(along / speed), passed(down / speed)
    u = _first_order(xp, filters[0], noise[0], d_u)
    v1, v2 = _double_pole(xp, filters[1], filters[2], noise[1], noise[2], d_u)
    w1, w2 = _double_pole(xp, filters[3], filters[4], noise[3], noise[4], d_w)
    lag = 4.0 * span / math.pi
    p = _first_order(xp, filters[5], noise[5], passed(lag / speed))
    # (1 + √3 T s) / (1 + T s)² = √3 / (1 + T s) + (1 − √3) / (1 + T s)²
    root = math.sqrt(3.0)
    v = sigma_u * (root * v1 + (1.0 - root) * v2)
    w = sigma_w * (root * w1 + (1.0 - root) * w2)
    # s / (1 + T s) = (1 − 1 / (1 + T s)) / T: what the slow part of a gust leaves over.
    keep_w, keep_v = xp.exp(-passed(lag / speed)), xp.exp(-passed(0.75 * lag / speed))
    slow_w = keep_w * filters[6] + (1.0 - keep_w) * w
    slow_v = keep_v * filters[7] + (1.0 - keep_v) * v
    # Variance of H_p: σ_w² / (V L_w) · 0.8 (π L_w / 4b)^⅓ · (π V / 4b) · π / 2 of its one-sided spectrum.
    third = xp.exp(xp.log(math.pi * down / (4.0 * span)) / 3.0)
    sigma_p = sigma_w * xp.sqrt((0.8 * math.pi**2 / (8.0 * span)) * third / down)
    gust = sigma_u * u, v, w, sigma_p * p, (w - slow_w) / lag, -(v - slow_v) / (0.75 * lag)
    return xp.stack((u, v1, v2, w1, w2, p, slow_w, slow_v)), gust


def _first_order(xp: object, before: Array, noise: Array, d: Array) -> Array:
    """A filter 1 / (1 + T s) whose output has variance 1, after d = dt / T."""
    keep = xp.exp(-d)  # type: ignore[attr-defined]
    return keep * before + xp.sqrt(1.0 - keep * keep) * noise  # type: ignore[attr-defined]


def _double_pole(xp: object, y1: Array, y2: Array, n1: Array, n2: Array, d: Array) -> tuple[Array, Array]:
    """1 / (1 + T s) and its second power, on one noise of intensity T: exact after d = dt / T.

    The noise that comes in adds e^−τ and τ e^−τ of its age τ, whose covariance over [0, d] has a closed form.
    """
    keep = xp.exp(-d)  # type: ignore[attr-defined]
    gone = keep * keep
    var1 = 0.5 * (1.0 - gone)
    both = 0.25 * (1.0 - gone * (1.0 + 2.0 * d))
    var2 = 0.25 * (1.0 - gone * (1.0 + 2.0 * d + 2.0 * d * d))
    sqrt = xp.sqrt  # type: ignore[attr-defined]
    root = sqrt(var1)
    e1, share = root * n1, both / root
    e2 = share * n1 + sqrt(clip(var2 - share * share, 0.0, None)) * n2
    return keep * y1 + e1, keep * (y2 + d * y1) + e2
