"""What differs between kinds of vehicles when a new one is made: motors, speeds, turn rates, height, identification."""

from __future__ import annotations

from collections import defaultdict
from math import sqrt
from typing import Any

from fulmar_core.robots.actuators.rolling import Rolling
from fulmar_core.robots.robot import Robot
from fulmar_evaluation.performance_gaps import fastest_in_water

ROOM = 1.25  # of a limit of the gates beyond what the robot does; our value [-]
FASTEST = 0.95  # largest turn rate of the gates, of the gyroscope's range; our value [-]


class Pushed:
    """Bodies that actuators push: what an actuator does is measured, and is no matter of the body's size."""

    computed = True  # whether performance follows from the wrenches of the actuators

    def motors(self, body: dict[str, Any], like: Robot) -> dict[str, float]:
        """Dotted keys of `actuators` that go with a new body, and their values."""
        return {}

    def top_speed(self, trial: Robot, like: Robot, force: float, pull: float) -> float:
        """Of what swims, where drag is full thrust; of what drifts, by its acceleration [m/s].

        Args:
            trial: The new robot.
            like: The robot that it is like.
            force: Largest of the new one [N].
            pull: Its acceleration over that of the other [-].
        """
        if trial.hydrodynamics is not None:
            return fastest_in_water(trial.hydrodynamics, force)
        return sqrt(pull) * like.performance.top_speed

    def yaw_rates(self, trial: Robot, like: Robot, turn: float) -> tuple[float, float]:
        """Turn rate that tasks ask for, and the limit of the gates; `turn` as `pull`, of turning [rad/s]."""
        limit = min(sqrt(turn) * like.limits.yaw_rate, FASTEST * trial.sensors.imu.gyroscope_range)
        return min(sqrt(turn) * like.performance.yaw_rate, limit / ROOM), limit

    def height(self, low: float, high: float, actuators: dict[str, Any]) -> float:
        """Of a hull between two heights in the body's frame [m]."""
        return high - low

    def identify(self, robot: Robot) -> tuple[str, ...]:
        """Steps of identification: a run with random commands, and its evaluation."""
        calibrated = (*robot.kind.calibrated, *robot.actuators.calibrated)
        if robot.actuators.excitation is None or not calibrated:
            return ()
        known = " --known mass=KG+-KG" if "mass" in calibrated and robot.hydrodynamics is None else ""
        what = ", ".join(each.replace("_", " ") for each in calibrated)
        run = f"runs/{robot.name}"
        return (
            f"fulmar run {robot.name} --controller excite --duration 120 --record {run}: a run to measure from",
            f"fulmar identify {run}{known} --out calibration.yaml: {what}",
        )


class OnWheels(Pushed):
    """Motors go with the weight, and wheels have the speeds of their drives."""

    def motors(self, body: dict[str, Any], like: Robot) -> dict[str, float]:
        """Force of the wheels."""
        force = like.actuated_by(Rolling).wheel_force
        return {"actuators.wheel_force": body["mass"] / like.body.mass * force}

    def top_speed(self, trial: Robot, like: Robot, force: float, pull: float) -> float:
        """Of the wheels [m/s]."""
        return min(like.performance.top_speed, float(trial.actuators.scale[0]))

    def yaw_rates(self, trial: Robot, like: Robot, turn: float) -> tuple[float, float]:
        """Of the wheels, and the other's limit [rad/s]."""
        asked = like.performance.yaw_rate
        return min(asked, trial.actuators.largest_yaw_rate or asked), like.limits.yaw_rate

    def height(self, low: float, high: float, actuators: dict[str, Any]) -> float:
        """From the floor on; the body's origin is at the height of the axles [m]."""
        return high + float(actuators["wheel_radius"])


class Turned(Pushed):
    """Reaction wheels go with the inertia."""

    def motors(self, body: dict[str, Any], like: Robot) -> dict[str, float]:
        """Torque and spin inertia of the wheels, by the moment that has shrunk most."""
        pairs = zip(body["inertia"][:3], like.body.inertia[:3], strict=True)
        least = min(each / other for each, other in pairs)
        return {
            f"actuators.{key}": least * getattr(like.actuators, key) for key in ("torque", "spin_inertia")
        }

    def identify(self, robot: Robot) -> tuple[str, ...]:
        """Inertia from a run that turns it."""
        return (f"fulmar identify runs/{robot.name}: inertia, from gyroscope and wheels of a run",)


class Flying(Pushed):
    """What an aircraft can do follows from its coefficients, which no shape says."""

    computed = False


RULES: dict[str, Pushed] = defaultdict(Pushed, rolling=OnWheels(), satellite=Turned(), aircraft=Flying())
