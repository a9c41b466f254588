"""A satellite in closed loop with its attitude estimator, in the core's own dynamics: no ROS, no simulator."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from fulmar_core.controllers.by_kind import exciting
from fulmar_core.controllers.classical import load_classical
from fulmar_core.estimators.kinds import make_estimator
from fulmar_core.estimators.readings import reading_problem
from fulmar_core.loop.control_loop import ControlLoop
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.sensors.kind import Truth
from fulmar_core.robots.sensors.simulated import SimulatedSensors
from fulmar_core.robots.sensors.wheels import WheelSpeeds
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.states.attitude import rotation_error
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks import load_task
from fulmar_core.wires.reading import Reading
from fulmar_core.worlds.scenario import load_scenario, sensors_in

TICK_NS = 50_000_000  # as plants measure, twice in a control step
BEGIN_NS = 1_000_000_000_000
# A reading's name, its value and the time in the run [s], to what arrives in its place; None: nothing.
Spoil = Callable[[str, Reading, float], Reading | None]


@dataclass
class Flight:
    """What happened in one run."""

    said: dict[str, float] = field(
        default_factory=dict
    )  # first time of each warning and problem, by words [s]
    errors_deg: list[float] = field(default_factory=list)  # of the estimate, after each step; NaN without one
    pointing_deg: list[float] = field(default_factory=list)  # of the satellite, from its goal
    rates_deg: list[float] = field(default_factory=list)  # true turn rate [deg/s]
    stopped_s: float = 0.0  # how long there was no estimate, once there had been one [s]
    outliers: int = 0
    epochs: int = 0
    status: dict[str, str] = field(default_factory=dict)

    def first(self, words: str) -> float:
        """When words were first said [s]; infinite if never."""
        return min((time for text, time in self.said.items() if words in text), default=np.inf)


def nothing(_name: str, reading: Reading, _time_s: float) -> Reading | None:
    """Spoils nothing."""
    return reading


def fly(
    name: str,
    *,
    task: str = "point_inertial",
    law: str = "lqr",
    scenario: str = "nominal",
    seconds: float = 60.0,
    seed: int = 0,
    spoil: Spoil = nothing,
    angle_deg: float | None = None,
    goals_s: float = 0.0,
) -> Flight:
    """Let an estimator's attitude control a satellite, as its controller does: without an estimate its torques are 0.

    Args:
        name: Of the robot.
        task: Of configs/tasks.
        law: Of its controller, or `excite`.
        scenario: Of configs/scenarios.
        seconds: How long.
        seed: Of everything.
        spoil: What happens to readings on their way.
        angle_deg: From the start to the goal; by default the task's.
        goals_s: Time after which another goal is given, again and again; 0: never [s].
    """
    robot, the_task, the_scenario = load_robot(name), load_task(task), load_scenario(scenario)
    if angle_deg is not None:
        the_task = replace(the_task, start=replace(the_task.start, angle_deg=(angle_deg, angle_deg)))
    simulation = BatchSimulation(
        robot, the_task, the_scenario, worlds=1, seed=seed, control_hz=20.0, dtype=np.float64
    )
    sensors = SimulatedSensors(sensors_in(robot, the_scenario), noisy=the_scenario.sensor_noise)
    sensors.reset(seed, 0)
    estimator = make_estimator("attitude", robot, exact_sensors=not the_scenario.sensor_noise)
    excites = law == "excite"
    controller = exciting(robot)(robot, the_task) if excites else load_classical(robot, the_task, law=law)
    loop = ControlLoop(robot, the_task, controller)
    loop.begin(simulation.goal)
    command = robot.actuators.safe_command
    flight, goals = Flight(), 0
    known: dict[str, np.ndarray] = {}  # newest speeds of the wheels
    for number in range(round(1e9 * seconds / TICK_NS)):
        now_ns = BEGIN_NS + number * TICK_NS
        now_s = 1e-9 * number * TICK_NS
        truth = simulation.truth[0].to_rigid()
        wheels = WheelSpeeds(robot.actuators.wheel_names, simulation.readings["wheels"][0].copy())
        readings = sensors.measure(Truth(truth, np.zeros(3), {"wheels": wheels}), now_s)
        for which, reading in sorted(readings.items()):
            stamped = replace(reading, stamp_ns=reading.stamp(now_ns))
            arrived = spoil(which, stamped, now_s)
            if arrived is not None and not reading_problem(which, arrived, robot):
                estimator.take(which, arrived)
                if which == "wheels":
                    known = {"wheels": arrived.value.speeds[None]}
        estimate = estimator.estimate(now_ns)
        for words in (*estimator.warnings(), *([estimator.problem] if estimator.problem else [])):
            flight.said.setdefault(words, now_s)
        error = np.nan
        if estimate is not None:
            off = rotation_error(tuple(truth.quat_xyzw), tuple(estimate.value.quat_xyzw))
            error = float(np.degrees(np.linalg.norm(off)))
        elif flight.errors_deg and np.isfinite(flight.errors_deg).any():
            flight.stopped_s += 1e-9 * TICK_NS
        if number % 2 == 0:
            command = robot.actuators.safe_command
            if estimate is not None:
                command = loop.step(SpatialState.from_rigid(estimate.value)[None], known, now_ns).command[0]
        flight.errors_deg.append(error)
        flight.rates_deg.append(float(np.degrees(np.linalg.norm(truth.angular_velocity_in_body))))
        flight.pointing_deg.append(
            float(np.degrees(the_task.errors(simulation.truth, simulation.goal).attitude[0]))
        )
        simulation.move(np.asarray(command)[None])
        if goals_s and now_s >= goals_s * (goals + 1):
            goals += 1
            drawn = BatchSimulation(
                robot, the_task, the_scenario, worlds=1, seed=1000 * seed + goals, dtype=np.float64
            )
            simulation.goal = drawn.goal
            loop.begin(drawn.goal)
    flight.outliers, flight.epochs, flight.status = estimator.outliers, estimator.epoch, estimator.status()
    return flight
