"""How robots of one kind are disturbed, move and are measured in a batch; one class for each state type."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, Generic

from fulmar_core.actuators.actuation import ActuationState
from fulmar_core.counter_rng import Draws
from fulmar_core.disturbances.scenario import Scenario, draw_world, longest_delay
from fulmar_core.disturbances.world import World
from fulmar_core.motion import control_step, may_be_off_centre
from fulmar_core.planar import PlanarState
from fulmar_core.robot import Robot
from fulmar_core.rotation import Array
from fulmar_core.sensors.odometer import Odometer
from fulmar_core.state import S
from fulmar_core.things import Poses, Thing, push_things


class Dynamics(ABC, Generic[S]):
    """Worlds, motion and odometry of one robot in one scenario, for many worlds at once; free of side effects."""

    def __init__(self, robot: Robot, scenario: Scenario) -> None:
        self.robot, self.scenario = robot, scenario
        self._latest_s = longest_delay(robot, scenario)

    @abstractmethod
    def draw_world(self, draws: Draws) -> World:
        """Draw worlds, one for each row of the draws, as NumPy float64."""

    @abstractmethod
    def odometer(self, *, seed: int, period: float) -> Odometer[S]:
        """The odometry of the worlds of a seed, read every `period` [s]."""

    @abstractmethod
    def step(self, state: S, actuation: ActuationState, world: World, *, time_s: Array, substeps: int) -> S:
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


class PlanarDynamics(Dynamics[PlanarState]):
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


def dynamics_of(robot: Robot, scenario: Scenario) -> Dynamics[Any]:
    """The dynamics of a robot's kind in a scenario."""
    return PlanarDynamics(robot, scenario)
