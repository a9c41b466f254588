"""Worlds whose numbers lie in one array: only faster than those whose do not."""

from __future__ import annotations

import copy
import pickle
from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.robots.robot_file import load_robot
from fulmar_core.states.counter_rng import WORLD, Draws
from fulmar_core.worlds.scenario import draw_world, load_scenario
from fulmar_core.worlds.world import FIELDS

ROBOT, SCENARIO = load_robot("kingfisher"), load_scenario("randomised")


def drawn(worlds=6, seed=1):
    return draw_world(ROBOT, SCENARIO, Draws(seed, np.arange(worlds), np.zeros(worlds), WORLD))


def same(one, other):
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)


@pytest.mark.parametrize("index", [2, slice(1, 4), np.array([5, 0])])
def test_packing_changes_no_number(index):
    loose = drawn()
    same(loose.packed(), loose)
    same(loose.packed()[index], loose[index])


@pytest.mark.parametrize("pack", [lambda world: world, lambda world: world.packed()], ids=["loose", "packed"])
def test_only_the_worlds_that_are_written_change(pack):
    world, before, new, index = drawn().packed(), drawn(), drawn(2, seed=9), np.array([4, 1])
    world.write(index, pack(new))
    same(world[index], new)
    same(world[np.array([0, 2, 3, 5])], before[np.array([0, 2, 3, 5])])


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda world: pickle.loads(pickle.dumps(world))])
@pytest.mark.parametrize("pack", [lambda world: world, lambda world: world.packed()], ids=["loose", "packed"])
def test_a_copy_is_written_without_its_original(pack, copied):
    world, new = pack(drawn()), pack(drawn(1, seed=9))
    twin = copied(world)
    twin.write(np.array([3]), new)
    for field in FIELDS:
        np.testing.assert_array_equal(getattr(twin, field)[..., 3:4], getattr(new, field), err_msg=field)
    same(world, drawn())


def test_a_world_with_another_field_is_written_in_that_field_too():
    changed = replace(drawn().packed(), drag=np.full(6, 7.0))
    changed.write(np.array([0]), drawn(1, seed=9).packed())
    assert changed.drag.tolist() == [drawn(1, seed=9).drag[0], *[7.0] * 5]
