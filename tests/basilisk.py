"""Basilisk in tests: one process for all of them, and a stand-in that answers by the core's dynamics."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from fulmar_core.dynamics.gyrostat import Flywheels, gyrostat_step
from fulmar_core.dynamics.rigid_body import inertia_of, rigid_body_step, turn_acceleration
from fulmar_core.robots.robot import Robot
from fulmar_core.states.attitude import plus, scaled, turn_back
from fulmar_core.states.spatial import SpatialState
from sim_nodes.basilisk_backend import BasiliskBackend
from sim_nodes.basilisk_process import BasiliskCraft


@functools.cache
def kept_craft() -> BasiliskCraft:
    """A body that is never removed, so that Basilisk starts once; it ends with our own process."""
    return BasiliskCraft()


def with_basilisk(robot: Robot, **options: Any) -> BasiliskBackend:
    """A backend with Basilisk itself; fails with the command that installs it where it is missing."""
    kept_craft()
    return BasiliskBackend(robot, **options)


class StandIn:
    """What `BasiliskCraft` answers, computed here: fast, and without Basilisk."""

    def __init__(self) -> None:
        self.requests: list[dict[str, Any]] = []

    def ask(self, **request: Any) -> dict[str, Any]:
        """See `BasiliskCraft.ask`."""
        self.requests.append(request)
        if "begin" in request:
            self._begin(request["begin"])
        for move in request.get("moves", ()):
            self._move(move)
        return self._state()

    def close(self) -> None:
        """Nothing to end."""

    def _begin(self, asked: dict[str, Any]) -> None:
        self._asked, self._dt = asked, 1e-9 * asked["step_ns"]
        self._mass, self._inertia = asked["mass"], np.array(asked["inertia"])
        quat = Rotation.from_mrp(asked["mrp"]).as_quat()
        self._body = SpatialState(
            *_vector(asked["position"]), *_vector(quat), *_vector(asked["velocity"]), *_vector(asked["rate"])
        )
        self._speeds = tuple(np.zeros(1) for _ in asked["wheels"])
        self._acceleration = self._turning = _vector(np.zeros(3))

    def _move(self, move: dict[str, Any]) -> None:
        if "mass" in move:
            self._mass, self._inertia = move["mass"], np.array(move["inertia"])
        force, torque = np.zeros(3), np.array(move["torque"])
        for thruster, thrust in zip(self._asked["thrusters"], move["drive"], strict=False):
            push = thrust * np.array(thruster["direction"])
            force = force + push
            torque = torque + np.cross(thruster["place"], push) + thruster["couple"] * push
        tensor = inertia_of(_vector(self._inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]))
        outside, mass = _vector(move["force"]), np.array([self._mass])
        for _ in range(move["steps"]):
            if self._asked["wheels"]:
                wheels = Flywheels(np.array(self._asked["wheels"]), self._asked["spin_inertia"])
                self._body, self._speeds = gyrostat_step(
                    self._body, self._speeds, _vector(torque), outside, lambda _: _vector(move["drive"]),
                    wheels, mass, tensor.tensor, self._dt,
                )  # fmt: skip
            else:
                self._body = rigid_body_step(
                    self._body, _vector(force), _vector(torque), outside, mass, tensor, self._dt
                )
        felt = plus(_vector(force), turn_back(self._body.quat, outside))
        self._acceleration = scaled(1.0 / self._mass, felt)
        self._turning = turn_acceleration(self._body.rate, _vector(torque), tensor)

    def _state(self) -> dict[str, Any]:
        state = self._body[0].to_rigid()
        return {
            "position": state.position_in_world.tolist(),
            "velocity": state.velocity_in_world.tolist(),
            "mrp": Rotation.from_quat(state.quat_xyzw).as_mrp().tolist(),
            "rate": state.angular_velocity_in_body.tolist(),
            "acceleration": [float(part[0]) for part in self._acceleration],
            "turn_acceleration": [float(part[0]) for part in self._turning],
            "speeds": [float(speed[0]) for speed in self._speeds],
        }


def _vector(parts: Any) -> tuple[np.ndarray, ...]:
    return tuple(np.array([float(part)]) for part in parts)
