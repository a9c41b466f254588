"""JSBSim as a backend: it integrates an aircraft; the core supplies servos, motors, gusts, disturbances and sensors."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import jsbsim
import numpy as np

from fulmar_core.attitude import euler_of, from_euler, minus, turn, turn_back
from fulmar_core.backend import Sample
from fulmar_core.disturbances.scenario import Scenario, sensors_in
from fulmar_core.episode import Episode
from fulmar_core.errors import ConfigError, SafetyError
from fulmar_core.flight.dynamics import FlightDynamics, flipped
from fulmar_core.flight.turbulence import Gust
from fulmar_core.motion import surface_positions_of
from fulmar_core.robot import Robot
from fulmar_core.sensors.kind import Truth
from fulmar_core.sensors.reading import Reading
from fulmar_core.sensors.simulated import SimulatedSensors
from fulmar_core.spatial import SpatialState
from fulmar_core.state import RigidBodyState
from fulmar_core.tasks import Task
from sim_nodes.jsbsim_model import FOOT, POUND, RADIUS_M, write_aircraft
from sim_nodes.one_world import OneWorld

STEPS = 4  # of JSBSim in a physics tick


class JsbsimBackend:
    """One aircraft in JSBSim, over a planet that does not turn; the world's x points east, y north, z up.

    Gusts along the craft's axes are wind to JSBSim; those about them it has no place for, and they are left out.
    """

    def __init__(
        self, robot: Robot, *, sensor_noise: bool = True, sensors: Mapping[str, Any] | None = None
    ) -> None:
        """Write the model and load it; `sensors` by name in the place of those of the robot's file.

        Raises:
            ConfigError: The robot is no aircraft.
        """
        self.robot = robot
        self._folder = tempfile.TemporaryDirectory(prefix="fulmar-jsbsim-")
        write_aircraft(robot, Path(self._folder.name))
        self._dynamics = FlightDynamics(robot)
        self._sensors = SimulatedSensors(sensors or robot.sensors.specs, noisy=sensor_noise)
        self._world = OneWorld(robot, noisy=sensor_noise)
        self._model = self._loaded()
        self._truth: RigidBodyState

    @classmethod
    def of(cls, robot: Robot, task: Task, scenario: Scenario) -> JsbsimBackend:
        """The simulator that a task and a scenario ask for."""
        return cls(robot, sensor_noise=scenario.sensor_noise, sensors=sensors_in(robot, scenario))

    def reset(self, episode: Episode, *, seed: int, number: int = 0) -> Sample:
        """Begin anew; see `Backend.reset`. Mass and inertia are those of the robot's file."""
        self._model = self._loaded()  # a model that has flown keeps the history of its integrators
        self._sensors.reset(seed, number)
        self._world.begin_episode(episode)
        self._gust: Gust | None = None
        self._time_s, self._lost = 0.0, False
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
            for name, value in zip(self.robot.actuators.names, applied[:, 0], strict=True):
                self._model[f"fulmar/{name}"] = float(value)
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
        for name, value in zip(self.robot.actuators.names, self.robot.actuators.safe_command, strict=True):
            self._model[f"fulmar/{name}"] = float(value)

    def close(self) -> None:
        """Let go of the model and its files."""
        self._folder.cleanup()

    def _loaded(self) -> jsbsim.FGFDMExec:
        folder, model = Path(self._folder.name), jsbsim.FGFDMExec(None)
        model.set_debug_level(0)
        model.set_aircraft_path(str(folder))
        planet = model.load_planet(str(folder / "still_planet.xml"), False)
        if not (planet and model.load_model(self.robot.name, True)):
            raise ConfigError(f"JSBSim cannot load the model of '{self.robot.name}'.")
        model.set_dt(self.robot.timing.physics_dt / STEPS)
        return model

    def _begin(self, start: SpatialState) -> None:
        state = start.mapped(lambda part: np.array([float(part)]))
        roll, pitch, yaw = (float(angle[0]) for angle in euler_of(state.quat))
        model = self._model
        model["ic/terrain-elevation-ft"] = 0.0
        model["ic/lat-gc-rad"], model["ic/long-gc-rad"] = (
            float(state.y[0]) / RADIUS_M,
            float(state.x[0]) / RADIUS_M,
        )
        model["ic/h-sl-ft"] = float(state.z[0]) / FOOT
        model["ic/phi-rad"], model["ic/theta-rad"] = roll, -pitch
        model["ic/psi-true-rad"] = math.remainder(0.5 * math.pi - yaw, 2.0 * math.pi)
        velocity = flipped(turn_back(state.quat, state.velocity))
        for axis, part in zip("uvw", velocity, strict=True):
            model[f"ic/{axis}-fps"] = float(part[0]) / FOOT
        for axis, part in zip("pqr", flipped(state.rate), strict=True):
            model[f"ic/{axis}-rad_sec"] = float(part[0])
        self.make_safe()
        model.run_ic()

    def _blow(self, state: SpatialState, dt: float) -> None:
        """Let the air move: wind, and the gusts along the craft's axes."""
        world: Any = self._world.world
        self._gust = self._dynamics.gust(state, self._world.actuation, world, dt)
        wind = (world.wind[0], world.wind[1], world.wind[2])
        if self._gust is not None:
            wind = minus(wind, turn(state.quat, flipped(tuple(-part for part in self._gust[:3]))))
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
        quat = from_euler(phi * one, -theta * one, (0.5 * math.pi - psi) * one)
        place = np.array(
            [
                model["position/long-gc-rad"] * RADIUS_M,
                model["position/lat-gc-rad"] * RADIUS_M,
                model["position/h-sl-meters"],
            ]
        )
        north, east, down = (model[f"velocities/v-{name}-fps"] * FOOT for name in ("north", "east", "down"))
        p, q, r = (model[f"velocities/{axis}-rad_sec"] for axis in "pqr")
        return RigidBodyState(
            place,
            np.array([float(part[0]) for part in quat]),
            np.array([east, north, -down]),
            np.array([p, -q, -r]),
        )

    def _sample(self, odometry: RigidBodyState) -> Sample:
        """All that sensors measure now."""
        model, truth = self._model, self._truth
        force = [model[f"forces/fb{axis}-total-lbs"] * POUND / self.robot.body.mass for axis in "xyz"]
        if self._lost:
            force = [0.0, 0.0, 0.0]
        world: Any = self._world.world  # of an aircraft
        air = self._dynamics.air_data(SpatialState.from_rigid(truth)[None], self._gust, world)
        surfaces = surface_positions_of(self.robot, self._world.actuation)
        felt = Truth(truth, np.array([force[0], -force[1], -force[2]]), air=air, surfaces=surfaces)
        return Sample({"odometry": Reading(odometry), **self._sensors.measure(felt, self._time_s)}, truth)
