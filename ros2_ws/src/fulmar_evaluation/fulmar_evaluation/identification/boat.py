"""A hull on water with propellers: drag, mass and inertia from its runs.

Motion alone shows drag over mass and thrust over mass. Here the thrust curve of the robot's YAML is what is known (a
bollard pull measures it), and it sets the scale of everything else: a curve that is wrong by a factor makes mass and
drag wrong by the same one, and a simulation with all three moves as the boat does.
"""

from __future__ import annotations

import numpy as np

from fulmar_core.dynamics.free_body import free_body_step
from fulmar_core.robots.actuators.propellers import Propellers
from fulmar_core.robots.calibration import DRAGS
from fulmar_core.robots.hydrodynamics import drag
from fulmar_core.robots.robot import Robot
from fulmar_core.states.planar import PlanarState
from fulmar_evaluation.identification.drives import Windows
from fulmar_evaluation.identification.held_input import followed, for_each_copy
from fulmar_evaluation.identification.model import (
    USEFUL_DELAY_S,
    PushedModel,
    Unknown,
    Values,
    nominal_world,
)


class BoatModel(PushedModel):
    """Unknowns: mass, yaw inertia, delay, linear and quadratic drag of surge, sway and yaw."""

    spans_s: tuple[float, ...] = (5.0, 10.0)

    def __init__(self, robot: Robot, propellers: Propellers) -> None:
        """Prepare for the nominal robot; its thrust curve, slew and added mass are taken for true."""
        assert robot.hydrodynamics is not None  # as in `by_kind.MODELS`
        self._robot, self._propellers, self._water = robot, propellers, robot.hydrodynamics
        unknowns = [
            Unknown("mass", robot.body.mass, "kg"),
            Unknown("yaw_inertia", robot.body.inertia[2], "kg·m²"),
            Unknown("delay", propellers.response.delay_s, "s", positive=False, useful=USEFUL_DELAY_S),
        ]
        for axis, i in DRAGS:
            force, speed = ("N·m", "rad/s") if axis == "yaw" else ("N", "m/s")
            drags = self._water.linear_damping[i], self._water.quadratic_damping[i]
            units = f"{force} per {speed}", f"{force} per ({speed})²"
            unknowns += [
                Unknown(
                    f"{axis}_{kind}_drag",
                    drag_now,
                    unit,
                    positive=False,
                    scale=max(*drags, 1.0),
                    useful=max(*drags, 1.0),
                )
                for kind, drag_now, unit in zip(("linear", "quadratic"), drags, units, strict=True)
            ]
        self.unknowns = tuple(unknowns)

    def predict(self, values: Values, own: np.ndarray, windows: Windows) -> np.ndarray:
        """See `Model.predict`."""
        pushes = for_each_copy(lambda delay: self._pushes(windows, delay), values["delay"])
        mass, inertia = values["mass"], values["yaw_inertia"]
        world = nominal_world(self._robot, mass=mass, yaw_inertia=inertia)
        outside = own[6] * mass, own[7] * mass, own[8] * inertia
        state = PlanarState(*own[:6])
        poses = np.empty((windows.steps + 1, 3, *own.shape[1:]))
        for step in range(windows.steps + 1):
            poses[step] = state.x, state.y, state.yaw
            if step < windows.steps:
                c, s = np.cos(state.yaw), np.sin(state.yaw)
                speeds = c * state.vx + s * state.vy, c * state.vy - s * state.vx, state.yaw_rate
                push = tuple(
                    pushes[step, i]
                    + drag(speed, values[f"{axis}_linear_drag"], values[f"{axis}_quadratic_drag"])
                    for i, ((axis, _), speed) in enumerate(zip(DRAGS, speeds, strict=True))
                )
                state = free_body_step(state, (push[0], push[1], push[2]), outside, world, None, windows.dt)
        return poses

    def _pushes(self, windows: Windows, delay: float) -> np.ndarray:
        """Wrench of the propellers in each step, shape (steps, 3, w)."""
        applied = followed(windows, delay, self._propellers.response.slew)
        wrench = self._propellers.planar_wrench(np.moveaxis(applied, 1, 0), np.ones(()))
        return np.stack(wrench, axis=1)
