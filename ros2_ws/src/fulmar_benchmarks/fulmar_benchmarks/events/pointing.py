"""Nadir pointing of a satellite whose gyroscope dies, on the rate of its event cameras: the closed loop without ROS."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from fulmar_core.controllers.classical import load_classical
from fulmar_core.dynamics.sky.event_sensor import EventSensor
from fulmar_core.estimators.kinds import make_estimator
from fulmar_core.loop.control_loop import ControlLoop
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.sensors.catalogue import load_stars
from fulmar_core.robots.sensors.wheels import NAME as WHEELS
from fulmar_core.simulation.episode import draw_episode
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import stack_goals
from fulmar_core.wires.reading import Reading
from fulmar_core.worlds.scenario import load_scenario

ROBOT, TASK, SCENARIO, CONTROLLER = "cubesat_wheels", "point", "gyro_dies", "pd"
SETTLED_S = 60.0  # after which errors count, and the gyroscope is dead
NAMES = ("events", "events_2")


def point_without_gyroscope(
    seed: int,
    *,
    seconds: float = 600.0,
    star_tracker: bool = True,
    events: bool = True,
    progress: Callable[[int], None] = lambda seconds: None,
) -> dict[str, Any]:
    """Run one episode in MuJoCo; the gyroscope dies after a minute.

    Args:
        seed: Of everything.
        seconds: Length of the episode [s].
        star_tracker: Whether the star tracker goes on after the gyroscope has died.
        events: Whether the event cameras run.
        progress: Called with the time that is simulated [s].

    Returns:
        JSON-ready: `rms_deg` and `max_deg` of the pointing error after the first minute, and `end_deg`, the last one.
    """
    from sim_nodes.mujoco_backend import MujocoBackend

    robot, task, scenario = load_robot(ROBOT), load_task(TASK), load_scenario(SCENARIO)
    backend = MujocoBackend.of(robot, task, scenario)
    attitude, rates = make_estimator("attitude", robot), make_estimator("event_rate", robot)
    sensors = [
        EventSensor(each.camera, each.pixels, load_stars(), name=name)
        for each, name in zip(robot.event_cameras, NAMES, strict=False)
    ]
    for sensor in sensors:
        sensor.reset(seed, 0)
    episode = draw_episode(robot, task, scenario, seed=seed, number=0)
    sample = backend.reset(episode, seed=seed)
    loop = ControlLoop(robot, task, load_classical(robot, task, law=CONTROLLER))
    loop.begin(stack_goals([episode.goal]))
    step_ns, substeps = round(1e9 * loop.dt), robot.timing.substeps(robot.timing.control_hz)
    errors, truth = [], sample.truth
    known: dict[str, np.ndarray] = {}  # newest speeds of the wheels
    goal, begun_ns, used_ns = stack_goals([episode.goal]), -1, -1
    for number in range(round(seconds / loop.dt)):
        now_ns = 1_000_000_000 + number * step_ns
        for name, reading in sorted(sample.readings.items()):
            lost = name == "star_tracker" and not star_tracker and number * loop.dt > SETTLED_S
            if name != "odometry" and not lost:
                stamped = Reading(reading.value, reading.stamp(now_ns), covariance=reading.covariance)
                attitude.take(name, stamped)
        newest = rates.estimate()
        if events and newest is not None and newest.stamp_ns != used_ns:
            used_ns = newest.stamp_ns
            attitude.take("rate", Reading(newest.value, newest.stamp_ns, covariance=newest.covariance))
        estimate = attitude.estimate(now_ns)
        command = robot.actuators.safe_command
        if estimate is not None:
            begun_ns = now_ns if begun_ns < 0 else begun_ns
            speeds = sample.readings.get(WHEELS)
            known = {WHEELS: speeds.value.speeds[None]} if speeds else known
            command = loop.step(SpatialState.from_rigid(estimate.value)[None], known, now_ns).command[0]
        before, sample = truth, backend.step(command, substeps)
        truth = sample.truth
        assert before is not None and truth is not None
        if events:
            _expose(sensors, rates, before, truth, now_ns, step_ns)
        if begun_ns >= 0:
            passed_s = np.asarray((now_ns + step_ns - begun_ns) / 1e9)
            goal = task.advance(goal, SpatialState.from_rigid(truth)[None], passed_s)
            errors.append(
                float(np.degrees(task.errors(SpatialState.from_rigid(truth)[None], goal).attitude[0]))
            )
        progress(int(number * loop.dt))
    backend.close()
    late = np.array(errors[round(SETTLED_S / loop.dt) :])
    return {
        "seed": seed,
        "rms_deg": float(np.sqrt(np.mean(late**2))),
        "max_deg": float(late.max()),
        "end_deg": float(late[-1]),
    }


def _expose(
    sensors: list[EventSensor], rates: Any, before: Any, after: Any, begin_ns: int, step_ns: int
) -> None:
    """Let the cameras watch a control step, and give their packets to the estimator."""
    from fulmar_core.states.attitude import rotation_error

    rate = np.array(rotation_error(tuple(before.quat_xyzw), tuple(after.quat_xyzw))) / (step_ns / 1e9)
    for sensor, name in zip(sensors, NAMES, strict=False):
        packet = sensor.expose(before.quat_xyzw, rate, begin_ns, step_ns)
        rates.take(name, Reading(packet, begin_ns + step_ns))
