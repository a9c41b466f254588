"""Quaternions against SciPy's, and the same in every array library."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from fulmar_core.states import rotation

EXACT = {"rtol": 0.0, "atol": 1e-12}  # some tens of float64 operations on numbers of order 1


@pytest.fixture
def quats():
    return Rotation.random(50, rng=np.random.default_rng(1)).as_quat()


@pytest.fixture
def vectors():
    return np.random.default_rng(2).normal(size=(50, 3))


def test_rotate_is_scipys_apply(quats, vectors):
    np.testing.assert_allclose(
        rotation.rotate(quats, vectors), Rotation.from_quat(quats).apply(vectors), **EXACT
    )


def test_rotate_inverse_undoes_rotate(quats, vectors):
    np.testing.assert_allclose(
        rotation.rotate_inverse(quats, rotation.rotate(quats, vectors)), vectors, **EXACT
    )


def test_multiply_is_composition_of_rotations(quats):
    p, q = quats[:25], quats[25:]
    expected = (Rotation.from_quat(p) * Rotation.from_quat(q)).as_matrix()
    np.testing.assert_allclose(Rotation.from_quat(rotation.multiply(p, q)).as_matrix(), expected, **EXACT)


def test_the_cross_product_is_numpys(vectors):
    np.testing.assert_allclose(
        rotation.cross(vectors, vectors[::-1]), np.cross(vectors, vectors[::-1]), **EXACT
    )


@settings(derandomize=True, deadline=None)
@given(yaw=st.floats(-3.141, 3.141))
def test_yaw_survives_the_way_through_a_quaternion(yaw):
    assert rotation.yaw_of(rotation.from_yaw(np.array(yaw))) == pytest.approx(yaw, abs=1e-12)


def test_yaw_is_the_direction_of_the_body_s_x_axis_whatever_roll_and_pitch():
    tilted = Rotation.from_euler("ZYX", [2.0, 0.4, -0.7])
    assert rotation.yaw_of(tilted.as_quat()) == pytest.approx(2.0, abs=1e-12)


@settings(derandomize=True, deadline=None)
@given(angle=st.floats(-50.0, 50.0))
def test_wrapping_changes_an_angle_by_whole_turns_only(angle):
    wrapped = float(rotation.wrap_angle(np.array(angle)))
    assert abs(wrapped) <= np.pi
    turns = (angle - wrapped) / (2.0 * np.pi)
    assert turns == pytest.approx(round(turns), abs=1e-12)


@pytest.mark.parametrize(
    ("function", "arguments"),
    [
        (rotation.rotate, "qv"),
        (rotation.rotate_inverse, "qv"),
        (rotation.multiply, "qq"),
        (rotation.cross, "vv"),
        (rotation.yaw_of, "q"),
        (rotation.from_yaw, "a"),
        (rotation.wrap_angle, "a"),
    ],
    ids=lambda value: getattr(value, "__name__", None),
)
def test_torch_gives_what_numpy_gives(function, arguments, quats, vectors):
    torch = pytest.importorskip("torch")
    table = {"q": quats, "v": vectors, "a": 3.0 * vectors[:, 0]}
    given_ = [table[letter] for letter in arguments]
    result = function(*(torch.as_tensor(value) for value in given_))
    assert isinstance(result, torch.Tensor)
    np.testing.assert_allclose(result.numpy(), function(*given_), **EXACT)
