"""What pushes a body from outside."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.counter_rng import WORLD, Draws
from fulmar_core.states.planar import PlanarState
from fulmar_core.worlds.scenario import draw_world, load_scenario
from fulmar_core.worlds.world import FIELDS, outside_wrench, push_is_constant

CALM = draw_world(
    load_robot("floating_platform"), load_scenario("ideal"), Draws.of_episode(0, 0, stream=WORLD)
)
DT = 0.2


def felt(x=0.0, y=0.0, *, time_s=0.0, **world):
    """Force along x and y, and moment, at one place and time."""
    state = PlanarState(*(np.array([value]) for value in (x, y, 0.7, 0.1, 0.2, 0.3)))
    changed = replace(CALM, **{name: np.array([value]) for name, value in world.items()})
    return [float(part[0]) for part in outside_wrench(state, changed, np.array([time_s]), DT)]


def test_a_still_world_pushes_nothing():
    assert felt(3.0, -2.0, time_s=7.0) == [0.0, 0.0, 0.0]


def test_a_constant_push_is_the_same_everywhere_and_always():
    for place in ((0.0, 0.0), (3.0, -2.0)):
        for time_s in (0.0, 9.9):
            assert felt(*place, time_s=time_s, force_x=0.1, force_y=-0.2, torque=0.03) == [0.1, -0.2, 0.03]


def test_a_wave_comes_again_after_its_length():
    wave = {
        "wave_force": 0.3,
        "wave_torque": 0.1,
        "wave_number": 2.0,
        "wave_phase_x": 0.4,
        "wave_phase_y": -0.9,
    }
    here = felt(0.7, 0.2, **wave)
    assert here == pytest.approx([0.3 * np.sin(1.8), 0.3 * np.sin(-0.5), 0.1 * np.sin(1.8)])
    assert felt(0.7 + np.pi, 0.2 - np.pi, **wave) == pytest.approx(here)
    assert felt(0.7 + np.pi / 2, 0.2, **wave)[0] == pytest.approx(-here[0])


def test_an_air_line_pulls_toward_its_anchor_in_proportion_to_the_way_and_turns_about_where_it_is_fastened():
    line = {"tether_stiffness": 0.05, "anchor_x": 1.0, "anchor_y": -0.5}
    assert felt(3.0, 0.5, **line) == pytest.approx([-0.1, -0.05, 0.0])
    yaw, lever = 0.7, 0.2  # the heading of every state of this file
    fx, fy, torque = felt(3.0, 0.5, **line, tether_x=lever)
    arm = lever * np.array([np.cos(yaw), np.sin(yaw)])
    assert [fx, fy] == pytest.approx([-0.1 - 0.05 * arm[0], -0.05 - 0.05 * arm[1]])
    assert torque == pytest.approx(arm[0] * fy - arm[1] * fx)
    assert abs(torque) > 1e-4


def test_a_kick_lasts_one_control_step_and_comes_once_a_period_but_not_at_the_start():
    kick = {"kick": 0.5, "kick_period": 4.3, "kick_direction": np.pi / 2}
    kicks = [felt(time_s=step * DT, **kick) for step in range(100)]
    assert np.array(kicks)[:, 0] == pytest.approx(0.0, abs=1e-12)
    when = np.flatnonzero(np.array(kicks)[:, 1] > 0.0) * DT
    np.testing.assert_allclose(when, np.ceil(np.arange(1, 5) * 4.3 / DT) * DT, atol=1e-9)
    assert max(kick[1] for kick in kicks) == 0.5


@pytest.mark.parametrize("field", FIELDS)
def test_whatever_makes_a_push_change_is_known_to_do_so(field):
    """A push that counts as constant is reckoned once in an episode."""
    moved = {"wave_number": 1.0, "kick_period": 3.0, "tether_x": 0.1, field: 1.7}
    pushes = [
        felt(*place, time_s=time_s, **moved)
        for place in ((0.3, 0.2), (1.1, 2.0))
        for time_s in (0.0, 3.1, 5.2)
    ]
    world = replace(CALM, **{name: np.array([value]) for name, value in moved.items()})
    assert push_is_constant(world) == all(push == pushes[0] for push in pushes)
