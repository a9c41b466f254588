"""A body on air with thrusters: mass, inertia, thrust, centre of mass and delays from its runs.

Motion alone shows thrust over mass and thrust over inertia, never the three apart: double all of them and nothing
changes. One known mass ends that. Either the platform was weighed, or it was driven with and without a ballast of known
mass Δ: with accelerations a and a' under the same valves, m = Δ a' / (a - a'), and the ballast may lie anywhere, since
inertia and centre of mass are estimated anew for each load.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fulmar_core.dynamics.free_body import free_body_step
from fulmar_core.dynamics.motion import to_center
from fulmar_core.robots.actuators.thrusters import Thrusters
from fulmar_core.robots.robot import Robot
from fulmar_core.states.planar import PlanarState
from fulmar_evaluation.identification.drives import Windows
from fulmar_evaluation.identification.held_input import valve_inputs
from fulmar_evaluation.identification.model import (
    USEFUL_DELAY_S,
    USEFUL_PLACE_M,
    PushedModel,
    Unknown,
    Values,
    nominal_world,
)


def ballast_name(load: int) -> str:
    """Name of the unknown that is the mass of a ballast."""
    return f"ballast_{load}"


def of_load(quantity: str, load: int) -> str:
    """Name of a quantity of the body under a load; that of the bare body has the plain name."""
    return f"{quantity}_with_ballast_{load}" if load else quantity


class PlatformModel(PushedModel):
    """Unknowns: thrust, mass, delays; and for each load inertia and centre of mass."""

    spans_s: tuple[float, ...] = (2.0, 5.0, 10.0)

    def __init__(self, robot: Robot, thrusters: Thrusters, ballasts: Mapping[int, float]) -> None:
        """Prepare.

        Args:
            robot: The nominal robot.
            thrusters: Its nozzles, whose places and directions are taken for true.
            ballasts: Mass of each load that was aboard in some run, from 1 on [kg].
        """
        self._robot, self._thrusters = robot, thrusters
        body = robot.body
        unknowns = [
            Unknown("thrust", thrusters.thrust, "N"),
            Unknown("mass", body.mass, "kg"),
            Unknown("delay", thrusters.response.delay_s, "s", positive=False, useful=USEFUL_DELAY_S),
            Unknown("opening_delay", 0.0, "s", positive=False, useful=USEFUL_DELAY_S),
        ]
        for load in (0, *ballasts):
            unknowns += [
                Unknown(of_load("yaw_inertia", load), body.inertia[2], "kg·m²"),
                Unknown(of_load("center_of_mass_x", load), 0.0, "m", positive=False, useful=USEFUL_PLACE_M),
                Unknown(of_load("center_of_mass_y", load), 0.0, "m", positive=False, useful=USEFUL_PLACE_M),
            ]
        unknowns += [Unknown(ballast_name(load), mass, "kg") for load, mass in ballasts.items()]
        self.unknowns = tuple(unknowns)
        self._loads = tuple(ballasts)

    def predict(self, values: Values, own: np.ndarray, windows: Windows) -> np.ndarray:
        """See `Model.predict`."""
        load = windows.load
        mass = values["mass"] + sum(
            (values[ballast_name(each)] * (load == each) for each in self._loads), np.zeros(len(load))
        )
        inertia, cx, cy = (
            self._by_load(values, name, load)
            for name in ("yaw_inertia", "center_of_mass_x", "center_of_mass_y")
        )
        inputs = valve_inputs(windows, self._wrench, values) * values["thrust"]
        world = nominal_world(self._robot, mass=mass, yaw_inertia=inertia, com_x=cx, com_y=cy)
        # Pushes are fitted as accelerations: a sloping floor gives the same one whatever the mass.
        outside = own[6] * mass, own[7] * mass, own[8] * inertia
        state = to_center(PlanarState(*own[:6]), world)
        poses = np.empty((windows.steps + 1, 3, *own.shape[1:]))
        for step in range(windows.steps + 1):
            origin = to_center(state, world, -1.0)
            poses[step] = origin.x, origin.y, origin.yaw
            if step < windows.steps:
                ahead, left, moment = inputs[step]
                push = ahead, left, moment - (cx * left - cy * ahead)
                state = free_body_step(state, push, outside, world, None, windows.dt)
        return poses

    def _by_load(self, values: Values, name: str, load: np.ndarray) -> np.ndarray:
        return np.asarray(sum(values[of_load(name, each)] * (load == each) for each in (0, *self._loads)))

    def _wrench(self, command: np.ndarray) -> np.ndarray:
        """Forces and moment if one open valve gave 1 N, shape (k, 3)."""
        wrench = self._thrusters.planar_wrench(command.T, np.ones_like(command.T))
        return np.stack(wrench, axis=1) / self._thrusters.thrust
