"""How robots of one kind are disturbed, move and are measured in a batch; one class for each state type."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, Generic, TypeVar

from fulmar_core.actuators.actuation import ActuationState
from fulmar_core.actuators.pushing import Pushing
from fulmar_core.attitude import Vector, cross, minus, plus, scaled
from fulmar_core.counter_rng import Draws
from fulmar_core.disturbances.scenario import Scenario, draw_world, longest_delay
from fulmar_core.disturbances.spatial_world import SpatialWorld, draw_spatial_world, push_in_world
from fulmar_core.disturbances.world import Drawn, World
from fulmar_core.dynamics.rigid_body import inertia_of, rigid_body_step, shifted
from fulmar_core.motion import control_step, may_be_off_centre
from fulmar_core.planar import PlanarState
from fulmar_core.robot import Robot
from fulmar_core.rotation import Array
from fulmar_core.sensors.odometer import Odometer
from fulmar_core.sensors.spatial_odometer import SpatialOdometer
from fulmar_core.spatial import SpatialState
from fulmar_core.state import S
from fulmar_core.things import Poses, Thing, push_things

W = TypeVar("W", bound=Drawn)


class Dynamics(ABC, Generic[W, S]):
    """Worlds, motion and odometry of one robot in one scenario, for many worlds at once; free of side effects."""

    def __init__(self, robot: Robot, scenario: Scenario) -> None:
        self.robot, self.scenario = robot, scenario
        self._latest_s = longest_delay(robot, scenario)

    @abstractmethod
    def draw_world(self, draws: Draws) -> W:
        """Draw worlds, one for each row of the draws, as NumPy float64."""

    @abstractmethod
    def odometer(self, *, seed: int, period: float) -> Odometer[S]:
        """The odometry of the worlds of a seed, read every `period` [s]."""

    @abstractmethod
    def step(self, state: S, actuation: ActuationState, world: W, *, time_s: Array, substeps: int) -> S:
        """Move through one control step; the actuators have their command already.

        Args:
            state: Of the body's origin, shapes (worlds,).
            actuation: What the actuators do.
            world: Bodies and surroundings.
            time_s: Time in each episode [s].
            substeps: Integration steps.

        Returns:
            State after `substeps` physics steps.
        """

    def push_things(self, things: Sequence[Thing], poses: Poses, before: S, after: S) -> tuple[Poses, S]:
        """Move the things of a task; arguments and result as of `things.push_things`. By default they stay."""
        return poses, after


class PlanarDynamics(Dynamics[World, PlanarState]):
    """Bodies on air, water or wheels that move in the plane."""

    def __init__(self, robot: Robot, scenario: Scenario) -> None:
        super().__init__(robot, scenario)
        self._off_centre = may_be_off_centre(robot, scenario)

    def draw_world(self, draws: Draws) -> World:
        """See `Dynamics.draw_world`."""
        return draw_world(self.robot, self.scenario, draws)

    def odometer(self, *, seed: int, period: float) -> Odometer[PlanarState]:
        """See `Dynamics.odometer`."""
        scenario = self.scenario
        return Odometer(
            self.robot.sensors.odometry,
            seed=seed,
            period=period,
            max_delay_s=scenario.sensing.delay_s,
            noisy=scenario.sensor_noise,
            blurred=scenario.sensing.blurred,
        )

    def step(
        self, state: PlanarState, actuation: ActuationState, world: World, *, time_s: Array, substeps: int
    ) -> PlanarState:
        """See `Dynamics.step`."""
        return control_step(
            self.robot,
            state,
            actuation,
            world,
            time_s=time_s,
            substeps=substeps,
            latest_s=self._latest_s,
            off_centre=self._off_centre,
        )

    def push_things(
        self, things: Sequence[Thing], poses: Poses, before: PlanarState, after: PlanarState
    ) -> tuple[Poses, PlanarState]:
        """See `Dynamics.push_things`."""
        return push_things(things, poses, before, after, self.robot)


class SpatialDynamics(Dynamics[SpatialWorld, SpatialState]):
    """Rigid bodies that float free."""

    def __init__(self, robot: Robot, scenario: Scenario) -> None:
        super().__init__(robot, scenario)
        self._off_centre = may_be_off_centre(robot, scenario)
        assert isinstance(robot.actuators, Pushing)  # as of `Robot.state_type`
        self._actuators = robot.actuators
        self._full = any(robot.body.tensor[3:])  # whether the inertia has more than its diagonal

    def draw_world(self, draws: Draws) -> SpatialWorld:
        """See `Dynamics.draw_world`."""
        return draw_spatial_world(self.robot, self.scenario, draws)

    def odometer(self, *, seed: int, period: float) -> SpatialOdometer:
        """See `Dynamics.odometer`."""
        scenario = self.scenario
        return SpatialOdometer(
            self.robot.sensors.odometry,
            seed=seed,
            period=period,
            max_delay_s=scenario.sensing.delay_s,
            noisy=scenario.sensor_noise,
            blurred=scenario.sensing.blurred,
        )

    def step(
        self,
        state: SpatialState,
        actuation: ActuationState,
        world: SpatialWorld,
        *,
        time_s: Array,
        substeps: int,
    ) -> SpatialState:
        """See `Dynamics.step`."""
        dt = self.robot.timing.physics_dt
        outside = push_in_world(world, time_s, substeps * dt)
        inertia = inertia_of(tuple(world.inertia)[: 6 if self._full else 3])
        com: Vector = (world.com[0], world.com[1], world.com[2])
        if self._off_centre:
            state = shifted(state, com)
        doing, force, torque = None, outside, outside
        for _ in range(substeps):
            applied = actuation.advance(dt, latest_s=self._latest_s)
            if applied is not doing:
                doing = applied
                force, torque = self._actuators.spatial_wrench(applied, actuation.gain)
                if self._off_centre:
                    torque = minus(torque, cross(com, force))
                torque = plus(torque, (world.torque[0], world.torque[1], world.torque[2]))
            state = rigid_body_step(state, force, torque, outside, world.mass, inertia, dt)
        return shifted(state, scaled(-1.0, com)) if self._off_centre else state


def dynamics_of(robot: Robot, scenario: Scenario) -> Dynamics[Any, Any]:
    """The dynamics of a robot's kind in a scenario."""
    return (
        SpatialDynamics(robot, scenario)
        if robot.state_type is SpatialState
        else PlanarDynamics(robot, scenario)
    )
