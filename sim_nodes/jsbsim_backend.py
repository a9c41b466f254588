"""JSBSim as a backend: it integrates an aircraft; the core supplies servos, motors, gusts, disturbances and sensors.

The aircraft is a robot's own file, or a model that comes with JSBSim: see `jsbsim_own_craft`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from fulmar_core.config.errors import SafetyError
from fulmar_core.dynamics.flight_dynamics import FlightDynamics, flipped
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.sensors.kind import Truth
from fulmar_core.robots.sensors.simulated import SimulatedSensors
from fulmar_core.simulation.backend import Sample
from fulmar_core.simulation.episode import Episode
from fulmar_core.states.attitude import (
    Quaternion,
    Vector,
    euler_of,
    from_euler,
    minus,
    product,
    turn,
    turn_back,
)
from fulmar_core.states.spatial import SpatialState
from fulmar_core.states.state import RigidBodyState
from fulmar_core.tasks import Task
from fulmar_core.wires.reading import Reading
from fulmar_core.worlds.scenario import Scenario, sensors_in
from fulmar_core.worlds.turbulence import Gust
from sim_nodes.jsbsim_craft import STEPS, ExportedCraft, JsbsimCraft
from sim_nodes.jsbsim_model import FOOT, POUND, RADIUS_M
from sim_nodes.jsbsim_own_craft import OwnCraft
from sim_nodes.one_world import OneWorld


class JsbsimBackend:
    """One aircraft in JSBSim, over a planet that does not turn; the world's x points east, y north, z up.

    Gusts along the craft's axes are wind to JSBSim; those about them it has no place for, and they are left out.
    """

    def __init__(
        self,
        robot: Robot,
        *,
        model: str = "",
        sensor_noise: bool = True,
        sensors: Mapping[str, Any] | None = None,
    ) -> None:
        """Load a model.

        Args:
            robot: An aircraft.
            model: One that comes with JSBSim; empty: the robot's own file.
            sensor_noise: Whether sensors have noise.
            sensors: By name, in the place of those of the robot's file.

        Raises:
            ConfigError: The robot is no aircraft, or JSBSim cannot load or fly the model.
        """
        self.robot = robot
        self.craft: JsbsimCraft = OwnCraft(robot, model) if model else ExportedCraft(robot)
        one = np.ones(1)
        self._nose: Quaternion = from_euler(0.0 * one, -self.craft.pitch * one, 0.0 * one)
        self._dynamics = FlightDynamics(robot)
        self._sensors = SimulatedSensors(sensors or robot.sensors.specs, noisy=sensor_noise)
        self._world = OneWorld(robot, noisy=sensor_noise)
        self._model = self.craft.loaded()
        self._truth: RigidBodyState

    @classmethod
    def of(cls, robot: Robot, task: Task, scenario: Scenario, model: str = "") -> JsbsimBackend:
        """The simulator that a task and a scenario ask for, with a model as in `__init__`."""
        return cls(
            robot, model=model, sensor_noise=scenario.sensor_noise, sensors=sensors_in(robot, scenario)
        )

    def reset(self, episode: Episode, *, seed: int, number: int = 0) -> Sample:
        """Begin anew; see `Backend.reset`. Mass and inertia are those of the model."""
        self._model = self.craft.loaded()  # a model that has flown keeps the history of its integrators
        self._sensors.reset(seed, number)
        self._world.begin_episode(episode)
        self._gust: Gust | None = None
        self._time_s, self._lost = 0.0, False
        actuation = self._world.actuation
        level = self.craft.level(actuation.applied[:, 0])[:, None]
        actuation.hold(level * self._world.world.alive)
        self._begin(episode.start)
        self._truth = self._read()
        return self._sample(self._world.first_measurement(self._truth, seed=seed, number=number))

    def step(self, command: np.ndarray, ticks: int = 1, *, begins: int | None = None) -> Sample:
        """Apply a command; see `Backend.step`.

        Raises:
            SafetyError: The state is not finite.
        """
        world, dt = self._world, self.robot.timing.physics_dt
        world.begin(np.asarray(command, dtype=float), ticks, self._truth, begins=begins)
        for _ in range(ticks):
            applied = world.actuation.advance(dt, latest_s=world.latest_s) * world.actuation.gain
            self._time_s += dt
            if self._lost:
                continue
            self.craft.steer(self._model, applied[:, 0])
            self._blow(SpatialState.from_rigid(self._truth)[None], dt)
            for _ in range(STEPS):
                self._model.run()
            self._truth = self._or_lost(SpatialState.from_rigid(self._read())[None])
        if not np.isfinite(self._truth.position_in_world).all():
            raise SafetyError(f"JSBSim's state is not finite at t = {self._time_s:.2f} s.")
        return self._sample(world.measure(self._truth))

    def stand(self, ticks: int = 1, *, begins: int | None = None) -> Sample:
        """An aircraft cannot stand; see `CanStand.stand`."""
        return self.step(self.robot.actuators.safe_command, ticks, begins=begins)

    def make_safe(self) -> None:
        """Neutral surfaces and idle throttles."""
        self.craft.steer(self._model, np.asarray(self.robot.actuators.safe_command))

    def close(self) -> None:
        """Let go of the model and its files."""
        self.craft.close()

    def _begin(self, start: SpatialState) -> None:
        state = self._in_its_axes(start.mapped(lambda part: np.array([float(part)])))
        roll, pitch, yaw = (float(angle[0]) for angle in euler_of(state.quat))
        model = self._model
        self.craft.start(model)
        model["ic/terrain-elevation-ft"] = self._altitude / FOOT
        model["ic/lat-gc-rad"], model["ic/long-gc-rad"] = (
            float(state.y[0]) / RADIUS_M,
            float(state.x[0]) / RADIUS_M,
        )
        model["ic/h-sl-ft"] = (self._altitude + float(state.z[0])) / FOOT
        model["ic/phi-rad"], model["ic/theta-rad"] = roll, -pitch
        model["ic/psi-true-rad"] = math.remainder(0.5 * math.pi - yaw, 2.0 * math.pi)
        velocity = flipped(turn_back(state.quat, state.velocity))
        for axis, part in zip("uvw", velocity, strict=True):
            model[f"ic/{axis}-fps"] = float(part[0]) / FOOT
        for axis, part in zip("pqr", flipped(state.rate), strict=True):
            model[f"ic/{axis}-rad_sec"] = float(part[0])
        self.craft.steer(model, self._world.actuation.applied[:, 0])
        model.run_ic()
        self._set_wind(self._mean_wind())  # `run_ic` leaves calm air behind
        model.suspend_integration()
        model.run()
        model.resume_integration()

    @property
    def _altitude(self) -> float:
        """Of the ground above mean sea level [m]."""
        world: Any = self._world.world
        return float(world.altitude[0])

    def _in_its_axes(self, state: SpatialState) -> SpatialState:
        """A state of the robot's body, with attitude and turn rate of the model's axes."""
        columns = zip(("qx", "qy", "qz", "qw"), product(state.quat, self._nose), strict=True)
        rates = zip(("wx", "wy", "wz"), turn_back(self._nose, state.rate), strict=True)
        return replace(state, **dict(columns), **dict(rates))

    def _blow(self, state: SpatialState, dt: float) -> None:
        """Let the air move: wind, and the gusts along the craft's axes."""
        world: Any = self._world.world
        self._gust = self._dynamics.gust(state, self._world.actuation, world, dt)
        wind = self._mean_wind()
        if self._gust is not None:
            wind = minus(wind, turn(state.quat, flipped(tuple(-part for part in self._gust[:3]))))
        self._set_wind(wind)

    def _mean_wind(self) -> Vector:
        world: Any = self._world.world
        return world.wind[0], world.wind[1], world.wind[2]

    def _set_wind(self, wind: Vector) -> None:
        east, north, up = (float(part[0]) for part in wind)
        for name, value in (("north", north), ("east", east), ("down", -up)):
            self._model[f"atmosphere/wind-{name}-fps"] = value / FOOT

    def _or_lost(self, after: SpatialState) -> RigidBodyState:
        """The state after a tick or, of a craft that is lost, where it was, at rest; for the rest of the episode."""
        kept = self._dynamics.where_it_flies(SpatialState.from_rigid(self._truth)[None], after)
        self._lost = not np.array_equal(kept.columns(), after.columns(), equal_nan=True)
        return kept[0].to_rigid()

    def _read(self) -> RigidBodyState:
        """Motion by JSBSim's own account."""
        model = self._model
        phi, theta, psi = (model[f"attitude/{name}-rad"] for name in ("phi", "theta", "psi"))
        one = np.array([1.0])
        x, y, z, w = self._nose
        quat = product(from_euler(phi * one, -theta * one, (0.5 * math.pi - psi) * one), (-x, -y, -z, w))
        place = np.array(
            [
                model["position/long-gc-rad"] * RADIUS_M,
                model["position/lat-gc-rad"] * RADIUS_M,
                model["position/h-sl-meters"] - self._altitude,
            ]
        )
        north, east, down = (model[f"velocities/v-{name}-fps"] * FOOT for name in ("north", "east", "down"))
        p, q, r = (model[f"velocities/{axis}-rad_sec"] for axis in "pqr")
        return RigidBodyState(
            place,
            np.array([float(part[0]) for part in quat]),
            np.array([east, north, -down]),
            self._in_robots_axes(p, q, r),
        )

    def _in_robots_axes(self, x: float, y: float, z: float) -> np.ndarray:
        """A vector of the model's axes (x ahead, y right, z down) in the robot's body, shape (3,)."""
        its = flipped((np.array([x]), np.array([y]), np.array([z])))
        return np.array([float(part[0]) for part in turn(self._nose, its)])

    def _sample(self, odometry: RigidBodyState) -> Sample:
        """All that sensors measure now."""
        model, truth = self._model, self._truth
        force = [model[f"forces/fb{axis}-total-lbs"] * POUND / self.craft.mass for axis in "xyz"]
        if self._lost:
            force = [0.0, 0.0, 0.0]
        felt_force = self._in_robots_axes(force[0], force[1], force[2])
        world: Any = self._world.world  # of an aircraft
        state = SpatialState.from_rigid(truth)[None]
        felt = Truth(
            truth, felt_force, self._dynamics.truths(state, self._world.actuation, world, self._gust)
        )
        return Sample({"odometry": Reading(odometry), **self._sensors.measure(felt, self._time_s)}, truth)
