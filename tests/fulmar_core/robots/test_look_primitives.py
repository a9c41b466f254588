"""Looks in boxes, cylinders and spheres alone."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.robots.look import Part
from fulmar_core.robots.look_primitives import primitives_of


def test_a_capsule_is_a_cylinder_with_a_ball_at_each_end():
    cylinder, *balls = primitives_of([Part("capsule", (0.2, 1.0), (1.0, 0.0, 0.0), (0.0, 90.0, 0.0), "red")])
    assert (cylinder.shape, cylinder.size, cylinder.at) == ("cylinder", (0.2, 0.8), (1.0, 0.0, 0.0))
    assert [ball.shape for ball in balls] == ["sphere", "sphere"]
    np.testing.assert_allclose([ball.at for ball in balls], [(0.6, 0.0, 0.0), (1.4, 0.0, 0.0)], atol=1e-12)
    assert {each.color for each in (cylinder, *balls)} == {"red"}


def test_a_capsule_as_long_as_it_is_wide_is_a_ball():
    (ball,) = primitives_of([Part("capsule", (0.2, 0.2))])
    assert (ball.shape, ball.size, ball.at) == ("sphere", (0.2,), (0.0, 0.0, 0.0))


def test_a_cone_is_a_stack_that_gets_narrower_towards_its_tip_and_is_as_long():
    steps = primitives_of([Part("cone", (0.5, 1.0))])
    assert {step.shape for step in steps} == {"cylinder"}
    widths, heights = [step.size[0] for step in steps], [step.at[2] for step in steps]
    assert widths == sorted(widths, reverse=True) and heights == sorted(heights)
    assert sum(step.size[1] for step in steps) == pytest.approx(1.0)
    assert heights[0] - 0.5 * steps[0].size[1] == pytest.approx(-0.5)
    assert np.mean(widths) == pytest.approx(0.25)


def test_other_parts_stay_as_they_are():
    parts = (Part("box", (1.0, 2.0, 3.0)), Part("sphere", (1.0,)), Part("cylinder", (1.0, 2.0)))
    assert primitives_of(parts) == parts
