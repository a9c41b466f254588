"""What robots on wheels share: chassis, wheels, casters, floor contact and the weight on them.

The body's frame lies at the height of the wheels' axles, its origin above the middle of the driven axle of the YAML.
"""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from fulmar_core.robots.actuators.response import Response
from fulmar_core.robots.actuators.rolling import CASTER_RADIUS, SERVO_S, WHEEL_WIDTH, Rolling
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.urdf import WHEEL_COLOUR
from fulmar_core.states.planar import PlanarState, PlanarWrench
from fulmar_core.worlds.world import World
from sim_nodes.mujoco_model.scenery import BODY, FLOOR_BIT, add_body

STEP_S = 0.004  # contacts and wheel servos need finer steps than the robots' physics ticks [s]
# Our values: no YAML says how heavy a wheel is or how high the weight lies.
WHEEL_SHARE = 0.03  # of the robot's mass, for each wheel [-]
WEIGHT_HEIGHT = (
    1.0 / 3.0
)  # of the robot's height, where its centre of mass is, but at least as high as the axles [-]
TIGHT_S = 0.005  # with which a wheel gives way to a push; the rest of its lag is in how it takes commands [s]
CONTACT_S = 0.01  # time constant of the floor contact [s]
SETTLE_S = 1.0  # time in which a model comes to rest after its compilation [s]


class Chassis:
    """A body on wheels; a family of robots on wheels adds its wheels and drives them (see `RobotModel`).

    Attributes:
        steady: The floor's forces are MuJoCo's own.
        rest_height: Height of the axles [m].
    """

    steady = True

    in_space = False

    def __init__(self, robot: Robot, drive: Rolling, *, weight_x: float) -> None:
        """Describe a robot with a drive; `weight_x`: of the centre of mass, ahead of the origin [m]."""
        self.robot, self.radius = robot, drive.wheel_radius
        self.friction, self.places = drive.friction, drive.wheels
        self.steps_per_tick = max(1, round(robot.timing.physics_dt / STEP_S))
        self.rest_height = drive.wheel_radius
        height = max(drive.wheel_radius, WEIGHT_HEIGHT * robot.body.height)
        self._weight = np.array([weight_x, 0.0, height - drive.wheel_radius])
        self._wheel_mass = WHEEL_SHARE * robot.body.mass
        self._settled = np.zeros(0)
        self._body = 0

    def add(self, spec: mujoco.MjSpec) -> mujoco.MjsBody:
        """Add the body and its outline, and set what contact with the floor needs."""
        spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
        spec.option.impratio = 10.0  # friction holds as firmly as the floor carries
        body = add_body(spec, self.robot, self.radius)
        outline = self.robot.body
        mass, place, inertia = self._chassis(outline.mass, outline.inertia[2], self._weight)
        body.mass, body.ipos, body.inertia = mass, list(place), list(inertia)
        return body

    def add_wheel(self, carrier: mujoco.MjsBody, name: str, place: tuple[float, float, float]) -> None:
        """Add one wheel with a joint of its name; its tyre is round across, so that it touches at one point."""
        wheel = carrier.add_body(name=name, pos=list(place))
        wheel.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 1, 0])
        wheel.explicitinertial = True
        wheel.mass, wheel.ipos, wheel.iquat = self._wheel_mass, [0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]
        wheel.inertia = list(self._wheel_inertia)
        wheel.add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_ELLIPSOID,
            size=[self.radius, 0.5 * WHEEL_WIDTH * self.radius, self.radius],
            rgba=list(WHEEL_COLOUR),
            condim=3,
            friction=[self.friction, 0.0, 0.0],
            priority=1,
            solref=[CONTACT_S, 1.0],
            contype=FLOOR_BIT,
            conaffinity=0,
        )

    def add_caster(self, body: mujoco.MjsBody, name: str, x: float) -> None:
        """Add one ball that slides on the floor without friction."""
        radius = CASTER_RADIUS * self.radius
        body.add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_SPHERE,
            size=[radius, 0.0, 0.0],
            pos=[x, 0.0, radius - self.radius],
            rgba=list(WHEEL_COLOUR),
            mass=0.0,
            condim=1,
            priority=1,
            solref=[CONTACT_S, 1.0],
            contype=FLOOR_BIT,
            conaffinity=0,
        )

    def add_wheel_servo(self, spec: mujoco.MjSpec, wheel: str, *, force: float, response: Response) -> None:
        """Add the motor of one wheel and the servo that makes it turn at a speed [rad/s].

        Args:
            spec: Model under construction.
            wheel: Name of the wheel and of its joint; the servo is called alike.
            force: The most that it pushes the robot [N]; what turns the wheel itself comes on top.
            response: How fast the wheel follows.
        """
        radius, mass = self.radius, self.robot.body.mass
        stiffness = mass / len(self.places) * radius**2 / TIGHT_S
        most = force * radius * (1.0 + 0.5 * WHEEL_SHARE * len(self.places))
        # The core's model moves a whole tick with the speed of its end, which makes it half a tick faster than its lag.
        lag = max(response.lag_s, SERVO_S) - 0.5 * self.robot.timing.physics_dt - TIGHT_S
        spec.add_actuator(
            name=wheel,
            trntype=mujoco.mjtTrn.mjTRN_JOINT,
            target=wheel,
            gaintype=mujoco.mjtGain.mjGAIN_FIXED,
            gainprm=[stiffness] + [0.0] * 9,
            biastype=mujoco.mjtBias.mjBIAS_AFFINE,
            biasprm=[0.0, 0.0, -stiffness] + [0.0] * 7,
            dyntype=mujoco.mjtDyn.mjDYN_FILTEREXACT,
            dynprm=[max(lag, STEP_S)] + [0.0] * 9,
            forcelimited=mujoco.mjtLimited.mjLIMITED_TRUE,
            forcerange=[-most, most],
        )

    def bind(self, model: mujoco.MjModel) -> None:
        """Let the compiled model come to rest, and remember how it stands."""
        self._body = model.body(BODY).id
        data = mujoco.MjData(model)
        mujoco.mj_step(model, data, round(SETTLE_S / model.opt.timestep))
        self._settled = np.array(data.qpos)
        self.rest_height = float(data.qpos[2])

    def take_world(self, model: mujoco.MjModel, world: World) -> None:
        """Take mass, inertia and centre of mass of an episode."""
        weight = self._weight + np.array([float(world.com_x), float(world.com_y), 0.0])
        mass, place, inertia = self._chassis(float(world.mass), float(world.yaw_inertia), weight)
        model.body_mass[self._body] = mass
        model.body_ipos[self._body] = place
        model.body_inertia[self._body] = inertia

    def own_truth(self, data: mujoco.MjData) -> dict[str, Any]:
        """Nothing: see `RobotModel.own_truth`."""
        return {}

    def place(self, model: mujoco.MjModel, data: mujoco.MjData, start: PlanarState) -> None:
        """Put the robot where it starts, as it stands at rest, with its wheels turning as it rolls."""
        data.qpos[:] = self._settled
        turned = np.empty(4)
        half = 0.5 * float(start.yaw)
        mujoco.mju_mulQuat(turned, np.array([np.cos(half), 0.0, 0.0, np.sin(half)]), self._settled[3:7])
        data.qpos[:2] = start.x, start.y
        data.qpos[3:7] = turned
        data.qvel[:6] = start.vx, start.vy, 0.0, 0.0, 0.0, start.yaw_rate

    def push(self, data: mujoco.MjData, outside: PlanarWrench) -> None:
        """Apply the push of the surroundings."""
        fx, fy, torque = outside
        data.xfrc_applied[self._body] = fx, fy, 0.0, 0.0, 0.0, torque

    @property
    def _wheel_inertia(self) -> np.ndarray:
        """A flat disc, about its middle [kg·m²]."""
        across = 0.5 * self._wheel_mass * self.radius**2
        return np.array([0.5 * across, across, 0.5 * across])

    def _chassis(
        self, mass: float, yaw_inertia: float, weight: np.ndarray
    ) -> tuple[float, np.ndarray, np.ndarray]:
        """Mass, place and moments of the chassis, so that robot and wheels together are what was asked for."""
        nominal = np.array(self.robot.body.inertia)
        inertia = nominal * (yaw_inertia / nominal[2])
        rest = mass - len(self.places) * self._wheel_mass
        wheels = np.array([[x, y, 0.0] for x, y in self.places.values()])
        place = (mass * weight - self._wheel_mass * wheels.sum(axis=0)) / rest
        inertia = inertia - rest * _about_axes(place - weight)
        for wheel in wheels:
            inertia = inertia - self._wheel_inertia - self._wheel_mass * _about_axes(wheel - weight)
        return rest, place, inertia


def _about_axes(offset: np.ndarray) -> np.ndarray:
    """Moments of 1 kg about axes through a point at some offset, shape (3,) [m²]."""
    square = offset * offset
    return square.sum() - square
