"""A body in space with thrusters: mass, inertia about its axes, thrust, centre of mass and delays from its runs.

As in the plane (`platform.py`), motion shows thrust over mass and over inertia, never the three apart: a known mass
sets the scale. The products of inertia are taken from the robot's YAML.
"""

from __future__ import annotations

import numpy as np

from fulmar_core.dynamics.rigid_body import inertia_of, rigid_body_step, shifted
from fulmar_core.robots.actuators.thrusters import Thrusters
from fulmar_core.robots.robot import Robot
from fulmar_core.states.attitude import (
    Vector,
    conjugate,
    cross,
    exponential,
    minus,
    plus,
    product,
    scaled,
    times,
)
from fulmar_core.states.spatial import SpatialState
from fulmar_evaluation.identification.drives import Windows
from fulmar_evaluation.identification.held_input import valve_inputs
from fulmar_evaluation.identification.model import USEFUL_DELAY_S, USEFUL_PLACE_M, Unknown, Values

INERTIAS = ("roll_inertia", "pitch_inertia", "yaw_inertia")
PLACES = ("center_of_mass_x", "center_of_mass_y", "center_of_mass_z")


class FreeFlyerModel:
    """Unknowns: thrust, mass, delays, three moments of inertia and the centre of mass."""

    # Position, rotation vector, velocity and turn rate; a constant push in the world [m/s²] and turn of the body
    # [rad/s²]: three numbers each.
    own = 18
    kinds: tuple[int, ...] = (0, 0, 0, 1, 1, 1, 1)
    channels: tuple[str, ...] = (
        "x_m",
        "y_m",
        "z_m",
        "quaternion_x_rad",
        "quaternion_y_rad",
        "quaternion_z_rad",
        "quaternion_w_rad",
    )
    spans_s: tuple[float, ...] = (2.0, 5.0)  # ten unknowns ask for many windows

    def __init__(self, robot: Robot, thrusters: Thrusters) -> None:
        """Prepare; the places and directions of the robot's nozzles are taken for true."""
        self._thrusters, self._products = thrusters, robot.body.tensor[3:]
        delays = {"delay": thrusters.response.delay_s, "opening_delay": 0.0}
        self.unknowns = (
            Unknown("thrust", thrusters.thrust, "N"),
            Unknown("mass", robot.body.mass, "kg"),
            *(
                Unknown(name, value, "s", positive=False, useful=USEFUL_DELAY_S)
                for name, value in delays.items()
            ),
            *(
                Unknown(name, value, "kg·m²")
                for name, value in zip(INERTIAS, robot.body.inertia[:3], strict=True)
            ),
            *(Unknown(name, 0.0, "m", positive=False, useful=USEFUL_PLACE_M) for name in PLACES),
        )

    def own_of(self, states: np.ndarray) -> np.ndarray:
        """See `Model.own_of`."""
        place, quat, velocity, change = np.split(states, (3, 7, 10))
        size = np.linalg.norm(quat, axis=0)
        x, y, z, w = quat = quat / size
        sine = np.sqrt(x * x + y * y + z * z)
        # Not the shortest rotation: the quaternion keeps its sign.
        factor = np.where(sine < 1e-6, 2.0, 2.0 * np.arctan2(sine, w) / np.maximum(sine, 1e-6))
        rate = product(conjugate((x, y, z, w)), tuple(2.0 * change / size))[:3]
        still = np.zeros((6, states.shape[1]))
        return np.concatenate((place, factor * quat[:3], velocity, np.stack(rate), still))

    def predict(self, values: Values, own: np.ndarray, windows: Windows) -> np.ndarray:
        """See `Model.predict`."""
        mass = values["mass"]
        moments = tuple(values[name] for name in INERTIAS)
        products = tuple(product * np.ones_like(mass) for product in self._products)
        inertia = inertia_of(moments + products if any(self._products) else moments)
        com: Vector = (values[PLACES[0]], values[PLACES[1]], values[PLACES[2]])
        inputs = valve_inputs(windows, self._wrench, values) * values["thrust"]
        place, rotation, velocity, rate, push, twist = map(_vector, np.split(own, 6))
        state = shifted(SpatialState(*place, *exponential(rotation), *velocity, *rate), com)
        back = scaled(-1.0, com)
        around, outside = times(inertia.tensor, twist), scaled(mass, push)
        poses = np.empty((windows.steps + 1, len(self.kinds), *own.shape[1:]))
        for step in range(windows.steps + 1):
            origin = shifted(state, back)
            for row, (value, scale) in enumerate(
                zip((*origin.position, *origin.quat), (1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 2.0), strict=True)
            ):
                poses[step, row] = scale * value
            if step < windows.steps:
                force: Vector = (inputs[step, 0], inputs[step, 1], inputs[step, 2])
                torque = minus((inputs[step, 3], inputs[step, 4], inputs[step, 5]), cross(com, force))
                state = rigid_body_step(
                    state, force, plus(torque, around), outside, mass, inertia, windows.dt
                )
        return poses

    def _wrench(self, command: np.ndarray) -> np.ndarray:
        """Force and torque if one open valve gave 1 N, shape (k, 6)."""
        return np.concatenate(self._thrusters.wrench_in_body(command), axis=1) / self._thrusters.thrust


def _vector(rows: np.ndarray) -> Vector:
    return rows[0], rows[1], rows[2]
