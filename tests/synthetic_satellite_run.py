"""A recorded run of a satellite without ROS, whose gyroscope may die: the core's dynamics and a plain law."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fulmar_core.controllers.classical import load_classical
from fulmar_core.loop.control_loop import ControlLoop
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import goal_in_float64
from fulmar_core.worlds.scenario import load_scenario
from tests.synthetic_run import EPOCH_NS, NS, RunMessages

ROBOT = "cubesat_wheels"
STEP_S = 0.1
STATUS_S = 1.0
STD = 0.004  # of the estimated inertia [kg·m²]


def write_satellite_run(
    folder: Path,
    *,
    task: str = "point_inertial",
    controller: str = "classical",
    seconds: float = 30.0,
    gyroscope_dies_s: float | None = None,
    estimated: bool = False,
) -> Path:
    """Write one run into a folder and return it; the estimator notices a dead gyroscope half a second late."""
    robot, does = load_robot(ROBOT), load_task(task)
    simulation = BatchSimulation(
        robot, does, load_scenario("nominal"), worlds=1, seed=3, control_hz=1.0 / STEP_S, dtype=np.float64
    )
    info = {
        "task": task,
        "controller": controller,
        "robot": ROBOT,
        "backend": "mujoco",
        "seed": 3,
        "lockstep": True,
    }
    bag = RunMessages(folder, robot, info | {"rate": 1.0, "control_hz": 1.0 / STEP_S, "scenario": "nominal"})
    bag.goal(does.goal_topic, simulation.goal[0], EPOCH_NS)
    loop = ControlLoop(robot, does, load_classical(robot, does))
    loop.begin(goal_in_float64(simulation.goal))
    for step in range(round(seconds / STEP_S) + 1):
        time_s, now_ns = STEP_S * step, EPOCH_NS + round(STEP_S * step * NS)
        truth = simulation.truth[0].to_rigid()
        bag.odometry("ground_truth/odom", truth, time_s, now_ns)
        bag.odometry("odom", truth, time_s, now_ns)
        wheels = simulation.readings["wheels"][0]
        bag.joints("wheels/state", wheels, time_s, now_ns, "velocity", robot.actuators.wheel_names)
        if gyroscope_dies_s is None or time_s <= gyroscope_dies_s:
            bag.imu(truth.angular_velocity_in_body, time_s, now_ns)
        if step % round(STATUS_S / STEP_S) == 0:
            dead = gyroscope_dies_s is not None and time_s > gyroscope_dies_s + 0.5
            source = "wheels" if step == 0 else "events" if dead else "gyroscope"
            bag.health("/diagnostics", "estimator", {"rate_from": source, "published": str(step)}, now_ns)
            if estimated:
                bag.inertia(robot.body.tensor, STD, time_s, now_ns)
        command = loop.step(simulation.measured, simulation.readings, round(time_s * NS)).command
        bag.command(command[0], time_s, now_ns + 2_000_000)
        bag.joints("actuators/state", command[0], time_s, now_ns + 3_000_000)
        simulation.step(command)
    bag.writer.close()
    return folder
