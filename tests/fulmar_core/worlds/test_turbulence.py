"""Dryden turbulence: its spread beside the specification, whatever the time step."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.dynamics.flight_dynamics import FlightDynamics
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.counter_rng import Draws
from fulmar_core.worlds.parts import Air
from fulmar_core.worlds.scenario import Scenario
from fulmar_core.worlds.turbulence import CLASSES, FILTERS, gust_step, lengths_and_intensities

SPAN, SPEED = 5.0, 28.0  # of the airship_v7 [m], [m/s]


def gusts(height, *, dt, seconds, craft=64, wind=CLASSES["light"]):
    """Gusts of many craft, shape (steps, 6, craft)."""
    keys = np.stack((np.arange(craft), 7 + 3 * np.arange(craft))).astype(float)
    filters, steps = np.full((FILTERS, craft), np.nan), np.zeros(craft, dtype=np.int64)
    still = {
        "airspeed": np.full(craft, SPEED),
        "height": np.full(craft, height),
        "wind": np.full(craft, wind),
    }
    found = []
    filters = np.zeros((FILTERS, craft))
    for _ in range(round(seconds / dt)):
        filters, gust = gust_step(filters, keys, steps, **still, span=SPAN, dt=dt)
        steps = steps + 1
        found.append(np.stack(gust))
    return np.array(found)


def test_lengths_and_intensities_are_those_of_the_specification_in_feet():
    """MIL-F-8785C at 8.2 ft, light: worked by hand."""
    along, down, sigma_u, sigma_w = lengths_and_intensities(np.array(2.5), np.array(7.72))
    assert float(along) == pytest.approx(19.09, rel=2e-3)
    assert float(down) == pytest.approx(2.5)
    assert (float(sigma_u), float(sigma_w)) == pytest.approx((1.520, 0.772), rel=2e-3)


def test_high_up_lengths_are_1750_feet():
    along, down, _, _ = lengths_and_intensities(np.array(1000.0), np.array(7.72))
    assert (float(along), float(down)) == pytest.approx((533.4, 533.4))


@pytest.mark.parametrize("height", [2.5, 100.0])
def test_640_craft_over_three_minutes_have_the_specified_spread(height):
    _, _, sigma_u, sigma_w = lengths_and_intensities(np.array(height), np.array(CLASSES["light"]))
    spread = gusts(height, dt=0.1, seconds=180.0, craft=640).std(axis=(0, 2))
    np.testing.assert_allclose(spread[:3], [sigma_u, sigma_u, sigma_w], rtol=0.03)


@pytest.mark.parametrize("dt", [0.002, 0.01, 1.0])
def test_the_spread_does_not_depend_on_the_time_step_and_is_there_from_the_first_step_on(dt):
    _, _, sigma_u, sigma_w = lengths_and_intensities(np.array(2.5), np.array(CLASSES["light"]))
    found = gusts(2.5, dt=dt, seconds=20 * dt, craft=4000)
    for step in (0, -1):
        np.testing.assert_allclose(found[step, :3].std(axis=-1), [sigma_u, sigma_u, sigma_w], rtol=0.05)


def test_the_spectrum_of_w_is_that_of_the_specification():
    """Φ_w = σ² L / (π V) (1 + 3 (L ω / V)²) / (1 + (L ω / V)²)², one-sided in rad/s."""
    from scipy.signal import welch

    height, dt = 100.0, 0.05
    _, down, _, sigma = lengths_and_intensities(np.array(height), np.array(CLASSES["light"]))
    w = gusts(height, dt=dt, seconds=150.0)[:, 2]
    hz, power = welch(w, 1.0 / dt, nperseg=1024, axis=0)
    omega, found = 2.0 * np.pi * hz, power.mean(axis=1) / (2.0 * np.pi)
    x = (float(down) * omega / SPEED) ** 2
    wanted = float(sigma) ** 2 * float(down) / (np.pi * SPEED) * (1.0 + 3.0 * x) / (1.0 + x) ** 2
    band = (omega > 0.2) & (omega < 8.0)
    assert np.median(found[band] / wanted[band]) == pytest.approx(1.0, abs=0.05)


def test_gusts_of_roll_pitch_and_yaw_have_the_size_that_the_span_gives():
    """σ_p² = σ_w² 0.8 (π L_w / 4b)^⅓ π² / (8 b L_w), the integral of Φ_p."""
    found = gusts(100.0, dt=0.05, seconds=60.0, craft=640).std(axis=(0, 2))
    _, down, _, sigma = lengths_and_intensities(np.array(100.0), np.array(CLASSES["light"]))
    third = (np.pi * float(down) / (4.0 * SPAN)) ** (1.0 / 3.0)
    wanted = float(sigma) * np.sqrt(0.8 * third * np.pi**2 / (8.0 * SPAN * float(down)))
    assert found[3] == pytest.approx(wanted, rel=0.05)
    assert 0.3 * wanted < found[4] < 3.0 * wanted
    assert 0.3 * wanted < found[5] < 3.0 * wanted


def test_worlds_of_one_key_have_the_same_gusts_whatever_the_batch():
    many, few = gusts(2.5, dt=0.01, seconds=0.5), gusts(2.5, dt=0.01, seconds=0.5, craft=3)
    np.testing.assert_array_equal(many[:, :, :3], few)


@pytest.mark.parametrize(("least", "low"), [(1.0, 7.7), (0.5, 3.85), (0.0, 0.0)])
def test_episodes_draw_turbulence_between_a_share_and_all_of_it(least, low):
    scenario = Scenario(
        "gusts", sensor_noise=False, body="nominal", air=Air(turbulence=7.7, least_turbulence=least)
    )
    drawn = FlightDynamics(load_robot("airship_v7")).draw_world(
        scenario, Draws(3, np.arange(2000), np.zeros(2000))
    )
    turbulence = np.asarray(drawn.turbulence)
    assert turbulence.min() == pytest.approx(low, abs=0.02)
    assert turbulence.max() == pytest.approx(7.7, abs=0.02)
    assert turbulence.mean() == pytest.approx(0.5 * (low + 7.7), abs=0.1)


@pytest.mark.parametrize("least", [-0.1, 1.1])
def test_a_share_of_turbulence_lies_between_nothing_and_all(least):
    with pytest.raises(ValueError, match=r"'least_turbulence' = .* must lie in \[0, 1\]"):
        Air(turbulence=7.7, least_turbulence=least)
