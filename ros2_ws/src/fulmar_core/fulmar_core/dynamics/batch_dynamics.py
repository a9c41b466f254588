"""How robots of one kind are disturbed, move and are measured in a batch; `by_kind.py` has the class of each.

Simulators that integrate bodies themselves take disturbances and odometry from here, on a batch of one.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Generic, TypeVar

import numpy as np

from fulmar_core.config.errors import ConfigError
from fulmar_core.dynamics.actuators.actuation import ActuationState
from fulmar_core.dynamics.actuators.wheel_actuation import WheelActuation
from fulmar_core.dynamics.free_body import Wrench, free_body_step
from fulmar_core.dynamics.gyrostat import Flywheels, gyrostat_step
from fulmar_core.dynamics.motion import left_of, to_center
from fulmar_core.dynamics.rigid_body import inertia_of, rigid_body_step, shifted
from fulmar_core.dynamics.rolling import rolling_step
from fulmar_core.dynamics.things import Poses, Thing, push_things
from fulmar_core.robots.actuators.pushing import Pushing
from fulmar_core.robots.actuators.reaction_wheels import ReactionWheels
from fulmar_core.robots.actuators.rolling import Rolling
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.sensors.odometer import Odometer
from fulmar_core.robots.sensors.spatial_odometer import SpatialOdometer
from fulmar_core.states.arrays import array_namespace
from fulmar_core.states.attitude import Vector, cross, minus, plus, scaled, turn_back
from fulmar_core.states.counter_rng import Draws
from fulmar_core.states.gravity import GRAVITY
from fulmar_core.states.planar import PlanarState
from fulmar_core.states.rotation import Array, from_yaw, multiply
from fulmar_core.states.spatial import SpatialState
from fulmar_core.states.state import RigidBodyState, S
from fulmar_core.worlds.scenario import Scenario, draw_world
from fulmar_core.worlds.shaped_world import shaped
from fulmar_core.worlds.spatial_world import (
    SpatialWorld,
    draw_spatial_world,
    grown,
    half_a_step_on,
    magnetic_field,
    orbit_torque,
    push_in_world,
    solar_torque,
)
from fulmar_core.worlds.world import Drawn, World, outside_wrench, push_is_constant

W = TypeVar("W", bound=Drawn)
Push = tuple[Array, ...]  # on a body in space, as its dynamics take it


@dataclass(frozen=True)
class Steps:
    """Integration steps under a command and a push that stay the same."""

    count: int
    latest_s: float = 0.0  # as in `longest_delay` [s]
    off_centre: bool = False  # as in `Dynamics.is_off_centre`


class Dynamics(ABC, Generic[W, S]):
    """Worlds, motion and odometry of one robot, for many worlds at once; free of side effects.

    Attributes:
        state_type: Form of the states.
        odometer: Class of the odometry.
    """

    state_type: type[S]
    odometer: Callable[..., Odometer[S]]

    def __init__(self, robot: Robot) -> None:
        self.robot = robot

    @abstractmethod
    def draw_world(self, scenario: Scenario, draws: Draws) -> W:
        """Draw worlds of a scenario, one for each row of the draws, as NumPy float64."""

    @abstractmethod
    def blurs(self, world: W) -> bool:
        """Whether measured velocities err beyond the robot's own sensors in any world, of NumPy arrays."""

    @abstractmethod
    def outside(self, state: S, world: W, time_s: Array, control_dt: float) -> Any:
        """Push of the surroundings, held over a control step, in the form that `move` takes.

        Args:
            state: Where the body is, shapes (worlds,).
            world: What surrounds it.
            time_s: Time in each episode [s].
            control_dt: Length of a kick [s].
        """

    @abstractmethod
    def push_is_constant(self, world: W) -> bool:
        """Whether every world is pushed in the same way wherever its body is, at any time; of NumPy arrays."""

    @abstractmethod
    def is_off_centre(self, world: W) -> bool:
        """Whether the centre of mass is beside the body's origin in any world, of NumPy arrays."""

    @abstractmethod
    def move(self, state: S, actuation: ActuationState, world: W, outside: Any, steps: Steps) -> S:
        """Move under a push that stays the same; the actuators have their command already.

        Args:
            state: Of the body's origin, shapes (worlds,).
            actuation: What the actuators do.
            world: Bodies and surroundings.
            outside: As in `outside`.
            steps: Integration steps.

        Returns:
            State after them.
        """

    @abstractmethod
    def under_wrench(self, state: S, wrench: Array, world: W) -> S:
        """State after one integration step under a wrench on the body.

        Args:
            state: Of the centre of mass.
            wrench: About it and in the body's frame: [F_x, F_y, M_z] or force and torque, shape (3 or 6, worlds).
            world: In which nothing else pushes.

        Raises:
            ConfigError: The robot takes no wrench.
        """

    def truths(self, state: S, actuation: ActuationState, world: W) -> dict[str, Any]:
        """What sensors measure beside the motion, of a batch of one, by their names; see `Truth.more`."""
        return actuation.truths()

    @abstractmethod
    def reported(self, measured: S, truth: RigidBodyState) -> RigidBodyState:
        """Odometry of one body, without a batch axis: what is measured, and of the rest the truth."""

    def reported_columns(self, measured: np.ndarray, truth: RigidBodyState) -> RigidBodyState:
        """The same of the columns of what is measured, shape (k, 1), as in `State.columns_of`."""
        return self.reported(self.state_type(*measured[:, 0]), truth)

    def push_things(self, things: Sequence[Thing], poses: Poses, before: S, after: S) -> tuple[Poses, S]:
        """Move the things of a task; arguments and result as in `things.push_things`. By default they stay."""
        return poses, after


class PlanarDynamics(Dynamics[World, PlanarState]):
    """Bodies on air or water that move in the plane."""

    state_type = PlanarState
    odometer = Odometer

    def draw_world(self, scenario: Scenario, draws: Draws) -> World:
        """See `Dynamics.draw_world`."""
        return draw_world(self.robot, scenario, draws)

    def blurs(self, world: World) -> bool:
        """See `Dynamics.blurs`."""
        return bool(world.velocity_noise.any() or world.yaw_rate_noise.any())

    def outside(self, state: PlanarState, world: World, time_s: Array, control_dt: float) -> Wrench:
        """Force along the world's x and y [N], and yaw moment [N·m]; see `Dynamics.outside`."""
        return outside_wrench(state, world, time_s, control_dt)

    def push_is_constant(self, world: World) -> bool:
        """See `Dynamics.push_is_constant`."""
        return push_is_constant(world)

    def is_off_centre(self, world: World) -> bool:
        """See `Dynamics.is_off_centre`."""
        return bool(world.com_x.any() or world.com_y.any())

    def move(
        self, state: PlanarState, actuation: ActuationState, world: World, outside: Wrench, steps: Steps
    ) -> PlanarState:
        """See `Dynamics.move`."""
        dt, water = self.robot.timing.physics_dt, self.robot.hydrodynamics
        actuators = self.robot.actuated_by(Pushing)
        if steps.off_centre:
            state = to_center(state, world)
        push: Wrench | None = None
        doing, body, lost = None, world, actuation.lost
        for _ in range(steps.count):
            applied = actuation.advance(dt, latest_s=steps.latest_s)
            if lost is not None:
                share, lost = left_of(world.mass, lost, actuation.lost)
                body = replace(world, mass=share * world.mass, yaw_inertia=share * world.yaw_inertia)
            if push is None or applied is not doing:
                doing = applied
                push = actuators.planar_wrench(applied, actuation.gain)
                if steps.off_centre:
                    ahead, left, moment = push
                    push = ahead, left, moment - (world.com_x * left - world.com_y * ahead)
            state = free_body_step(state, push, outside, body, water, dt)
        return to_center(state, world, -1.0) if steps.off_centre else state

    def under_wrench(self, state: PlanarState, wrench: Array, world: World) -> PlanarState:
        """See `Dynamics.under_wrench`."""
        push, still = (wrench[0], wrench[1], wrench[2]), (0.0 * wrench[0],) * 3
        return free_body_step(
            state, push, still, world, self.robot.hydrodynamics, self.robot.timing.physics_dt
        )

    def reported(self, measured: PlanarState, truth: RigidBodyState) -> RigidBodyState:
        """A planar measurement with the true height, roll and pitch."""
        roll_rate, pitch_rate, _ = truth.angular_velocity_in_body
        return RigidBodyState(
            np.array((measured.x, measured.y, truth.position_in_world[2])),
            multiply(from_yaw(measured.yaw - truth.yaw), truth.quat_xyzw),
            np.array((measured.vx, measured.vy, truth.velocity_in_world[2])),
            np.array((roll_rate, pitch_rate, measured.yaw_rate)),
        )

    def push_things(
        self, things: Sequence[Thing], poses: Poses, before: PlanarState, after: PlanarState
    ) -> tuple[Poses, PlanarState]:
        """See `Dynamics.push_things`."""
        return push_things(things, poses, before, after, self.robot)


class RollingDynamics(PlanarDynamics):
    """Bodies on wheels that do not slip sideways."""

    def move(
        self, state: PlanarState, actuation: ActuationState, world: World, outside: Wrench, steps: Steps
    ) -> PlanarState:
        """See `Dynamics.move`; where the centre of mass is does not count."""
        dt, wheels = self.robot.timing.physics_dt, self.robot.actuated_by(Rolling)
        for _ in range(steps.count):
            target = actuation.advance(dt, latest_s=steps.latest_s)
            state = rolling_step(state, target, actuation.gain, outside, world, wheels, dt)
        return state

    def under_wrench(self, state: PlanarState, wrench: Array, world: World) -> PlanarState:
        """Refuse; see `Dynamics.under_wrench`."""
        raise ConfigError(
            f"'{self.robot.name}' rolls on wheels, which take commands and no wrench. Use `linearise`, whose inputs "
            "are commands."
        )

    def push_things(
        self, things: Sequence[Thing], poses: Poses, before: PlanarState, after: PlanarState
    ) -> tuple[Poses, PlanarState]:
        """See `Dynamics.push_things`; wheels hold their speed."""
        return super().push_things(things, poses, before, after)[0], after


class SpatialDynamics(Dynamics[SpatialWorld, SpatialState]):
    """Rigid bodies that float free, or under their weight where their kind has any."""

    state_type = SpatialState
    odometer = SpatialOdometer

    def __init__(self, robot: Robot, *, orbits: bool = True) -> None:
        """Prepare; `orbits`: some world may have the gravity gradient of an orbit."""
        super().__init__(robot)
        self._orbits = orbits
        self._full = any(robot.body.tensor[3:])  # whether the inertia has more than its diagonal

    def draw_world(self, scenario: Scenario, draws: Draws) -> SpatialWorld:
        """See `Dynamics.draw_world`."""
        world = draw_spatial_world(self.robot, scenario, draws)
        return shaped(self.robot, world, draws) if scenario.body == "morphology" else world

    def blurs(self, world: SpatialWorld) -> bool:
        """See `Dynamics.blurs`."""
        return bool(world.velocity_noise.any() or world.rate_noise.any())

    def outside(self, state: SpatialState, world: SpatialWorld, time_s: Array, control_dt: float) -> Push:
        """Force along the world's axes [N], and torque about the body's [N·m]; see `Dynamics.outside`.

        The torque is that of an orbit in the middle of the step, and left out where no world has one; the constant one
        of a world is not in it.
        """
        force = push_in_world(world, time_s, control_dt)
        if not self._orbits:
            return force
        return *force, *orbit_torque(half_a_step_on(state, control_dt), world, time_s + 0.5 * control_dt)

    def push_is_constant(self, world: SpatialWorld) -> bool:
        """See `Dynamics.push_is_constant`."""
        return not (world.kick.any() or world.orbit_rate.any())

    def is_off_centre(self, world: SpatialWorld) -> bool:
        """See `Dynamics.is_off_centre`."""
        return bool(world.com.any())

    def move(
        self, state: SpatialState, actuation: ActuationState, world: SpatialWorld, outside: Push, steps: Steps
    ) -> SpatialState:
        """See `Dynamics.move`."""
        dt, actuators = self.robot.timing.physics_dt, self.robot.actuated_by(Pushing)
        inertia = inertia_of(tuple(world.inertia)[: 6 if self._full else 3])
        com: Vector = (world.com[0], world.com[1], world.com[2])
        if steps.off_centre:
            state = shifted(state, com)
        push: Vector = (outside[0], outside[1], outside[2])
        if self.robot.kind.weighs:
            push = push[0], push[1], push[2] - GRAVITY * world.mass
        steady: Vector = (world.torque[0], world.torque[1], world.torque[2])
        if len(outside) > 3:
            steady = plus(steady, (outside[3], outside[4], outside[5]))
        doing, force, torque = None, push, push
        mass, turning, lost = world.mass, inertia, actuation.lost
        for _ in range(steps.count):
            applied = actuation.advance(dt, latest_s=steps.latest_s)
            if lost is not None:
                share, lost = left_of(world.mass, lost, actuation.lost)
                mass, turning = share * world.mass, inertia.scaled(share)
            if applied is not doing:
                doing = applied
                force, torque = world.pushed(actuators, applied, actuation.gain)
                if steps.off_centre:
                    torque = minus(torque, cross(com, force))
                torque = plus(torque, steady)
            state = rigid_body_step(state, force, torque, push, mass, turning, dt)
        return shifted(state, scaled(-1.0, com)) if steps.off_centre else state

    def under_wrench(self, state: SpatialState, wrench: Array, world: SpatialWorld) -> SpatialState:
        """See `Dynamics.under_wrench`."""
        force, torque = (wrench[0], wrench[1], wrench[2]), (wrench[3], wrench[4], wrench[5])
        inertia = inertia_of(tuple(world.inertia))
        return rigid_body_step(state, force, torque, None, world.mass, inertia, self.robot.timing.physics_dt)

    def reported(self, measured: SpatialState, truth: RigidBodyState) -> RigidBodyState:
        """See `Dynamics.reported`."""
        return measured.to_rigid()

    def reported_columns(self, measured: np.ndarray, truth: RigidBodyState) -> RigidBodyState:
        """See `Dynamics.reported_columns`."""
        column = measured[:, 0]
        return RigidBodyState(column[:3], column[3:7], column[7:10], column[10:])


class GyrostatDynamics(SpatialDynamics):
    """Satellites that reaction wheels turn, whose inertia may change, under sunlight and in a magnetic field."""

    def __init__(self, robot: Robot) -> None:
        """Prepare; every world may have an orbit."""
        super().__init__(robot)
        self._wheels = robot.actuated_by(ReactionWheels)
        self._flywheels = Flywheels(self._wheels.axes, self._wheels.spin_inertia)
        unloading = self._wheels.unloading
        self._magnetic = unloading is not None and unloading.kind == "magnetic"

    def outside(self, state: SpatialState, world: SpatialWorld, time_s: Array, control_dt: float) -> Push:
        """Ten numbers, held over a control step, as in the middle of it; see `Dynamics.outside`.

        Force along the world's axes [N], torque about the body's [N·m] with the constant one, direction of the magnetic
        field in the world, and factor on the inertia.
        """
        growth = grown(world, time_s)
        steady: Vector = (world.torque[0], world.torque[1], world.torque[2])
        amid, middle_s = half_a_step_on(state, control_dt), time_s + 0.5 * control_dt
        torque = plus(
            plus(steady, solar_torque(amid, world)), scaled(growth, orbit_torque(amid, world, middle_s))
        )
        force = push_in_world(world, time_s, control_dt)
        return (*force, *torque, *magnetic_field(world.orbit_rate, middle_s), growth)

    def push_is_constant(self, world: SpatialWorld) -> bool:
        """See `Dynamics.push_is_constant`."""
        return False

    def move(
        self, state: SpatialState, actuation: ActuationState, world: SpatialWorld, outside: Push, steps: Steps
    ) -> SpatialState:
        """See `Dynamics.move`; of `outside` what is left out is nothing."""
        assert isinstance(actuation, WheelActuation)  # as in `actuation_of`
        dt, wheels = self.robot.timing.physics_dt, self._wheels
        force: Vector = (outside[0], outside[1], outside[2])
        tensor = tuple(world.inertia)[: 6 if self._full else 3]
        steady, field = scaled(0.0, force), None
        if len(outside) > 3:
            steady, growth = (outside[3], outside[4], outside[5]), outside[9]
            tensor = tuple(growth * entry for entry in tensor)
            field = (outside[6], outside[7], outside[8]) if self._magnetic else None
        for _ in range(steps.count):
            applied = actuation.advance(dt, latest_s=steps.latest_s) * actuation.gain
            motors = wheels.motor_torque(applied[: wheels.count], actuation.speeds, dt)
            torque, here = steady, None if field is None else turn_back(state.quat, field)
            unloading = wheels.unloading_torque(applied, here)
            state, speeds = gyrostat_step(
                state,
                tuple(actuation.speeds),
                torque if unloading is None else plus(torque, unloading),
                force,
                partial(_on_wheels, wheels, tuple(motors)),
                self._flywheels,
                world.mass,
                tensor,
                dt,
            )
            actuation.speeds = array_namespace(applied).stack(speeds)
        return state


def _on_wheels(wheels: ReactionWheels, motors: tuple[Array, ...], speeds: tuple[Array, ...]) -> Push:
    """Torque on each wheel: of its motor and of its bearing [N·m]."""
    if not wheels.has_friction:
        return motors
    return tuple(motor + wheels.friction_torque(speed) for motor, speed in zip(motors, speeds, strict=True))
