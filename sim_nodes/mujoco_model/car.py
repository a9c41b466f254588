"""Four driven wheels, the front ones steered as on a car."""

from __future__ import annotations

import math

import mujoco
import numpy as np

from fulmar_core.robots.actuators.ackermann import Ackermann
from fulmar_core.robots.robot import Robot
from fulmar_core.states.planar import PlanarState, PlanarWrench
from sim_nodes.mujoco_model.wheels import Chassis

STEERING_HZ = 25.0  # bandwidth of the steering servos [Hz]
STEERING_DAMPING = 0.7  # of critical [-]
KNUCKLE_INERTIA = 2e-3  # of what turns with a steered wheel, and of its servo's gears [kg·m²]
SIDES = (("left", 0.5), ("right", -0.5))


class Car(Chassis):
    """Every wheel has a motor that turns it at the speed of rolling without slip, all with the same largest force."""

    def __init__(self, robot: Robot) -> None:
        self._car = robot.actuated_by(Ackermann)
        super().__init__(robot, self._car, weight_x=0.5 * self._car.wheelbase)

    def add(self, spec: mujoco.MjSpec) -> mujoco.MjsBody:
        """Add chassis, steering, wheels and servos; see `RobotModel.add`."""
        body = super().add(spec)
        for name, (x, y) in self.places.items():
            carrier, place = body, (x, y, 0.0)
            if name.startswith("front"):
                carrier, place = self._add_knuckle(spec, body, name, place), (0.0, 0.0, 0.0)
            self.add_wheel(carrier, name, place)
        force = self._car.wheel_force / len(self.places)
        for name in self.places:
            self.add_wheel_servo(spec, name, force=force, response=self._car.response)
        return body

    def bind(self, model: mujoco.MjModel) -> None:
        """See `RobotModel.bind`."""
        super().bind(model)
        names = [*(f"front_{side}_steering" for side, _ in SIDES), *self.places]
        self._dofs = np.array([model.joint(name).dofadr[0] for name in names])
        self._controls = np.array([model.actuator(name).id for name in names])

    def place(self, model: mujoco.MjModel, data: mujoco.MjData, start: PlanarState) -> None:
        """See `RobotModel.place`; the wheels start straight."""
        super().place(model, data, start)
        ahead, _ = start.velocity_in_body
        data.qvel[self._dofs[2:]] = data.act[:] = float(ahead) / self._car.wheel_radius

    def drive(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        applied: np.ndarray,
        gain: np.ndarray,
        outside: PlanarWrench,
    ) -> None:
        """Set steering angles and wheel speeds; see `RobotModel.drive`."""
        speed, steering = applied * gain
        data.ctrl[self._controls] = self.wheel_targets(float(speed), float(steering))
        self.push(data, outside)

    def wheel_targets(self, speed: float, steering: float) -> list[float]:
        """Steering angles and wheel speeds of a car that rolls without slip (Ackermann).

        Args:
            speed: Ahead, of the middle of the rear axle [m/s].
            steering: Of the middle front wheel, left positive [rad].

        Returns:
            Angles of the left and the right front wheel [rad], then speeds of rear left, rear right, front left and
            front right [rad/s].
        """
        curvature = math.tan(steering) / self._car.wheelbase
        # Share of the speed with which each side moves ahead.
        sides = [1.0 - curvature * share * self._car.track for _, share in SIDES]
        angles = [math.atan(math.tan(steering) / side) for side in sides]
        rear = [speed * side / self._car.wheel_radius for side in sides]
        front = [spin / math.cos(angle) for spin, angle in zip(rear, angles, strict=True)]
        return [*angles, *rear, *front]

    def _add_knuckle(
        self, spec: mujoco.MjSpec, body: mujoco.MjsBody, wheel: str, place: tuple[float, float, float]
    ) -> mujoco.MjsBody:
        """Add what turns with a steered wheel, and the servo that turns it."""
        name = f"{wheel}_steering"
        knuckle = body.add_body(name=name, pos=list(place))
        knuckle.explicitinertial = True
        knuckle.mass, knuckle.ipos, knuckle.iquat = 1e-6, [0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]
        knuckle.inertia = [1e-9, 1e-9, 1e-9]
        knuckle.add_joint(
            name=name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 0, 1], armature=KNUCKLE_INERTIA
        )
        omega = 2.0 * math.pi * STEERING_HZ
        stiffness, damping = KNUCKLE_INERTIA * omega**2, 2.0 * STEERING_DAMPING * KNUCKLE_INERTIA * omega
        spec.add_actuator(
            name=name,
            trntype=mujoco.mjtTrn.mjTRN_JOINT,
            target=name,
            gaintype=mujoco.mjtGain.mjGAIN_FIXED,
            gainprm=[stiffness] + [0.0] * 9,
            biastype=mujoco.mjtBias.mjBIAS_AFFINE,
            biasprm=[0.0, -stiffness, -damping] + [0.0] * 7,
            dyntype=mujoco.mjtDyn.mjDYN_NONE,
        )
        return knuckle
