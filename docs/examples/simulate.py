"""A thousand robots at once, steered by four lines of NumPy: no ROS, no simulator, no controller class."""

import numpy as np

from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario

robot, task = load_robot("turtlebot2"), load_task("go_to_position")
worlds = BatchSimulation(robot, task, load_scenario("nominal"), worlds=1000, seed=1)
for _ in range(round(task.episode_s / worlds.control_dt)):
    state, goal = worlds.measured, worlds.goal.current
    dx, dy = goal[:, 0] - state.x, goal[:, 1] - state.y
    distance, bearing = np.hypot(dx, dy), np.arctan2(dy, dx) - state.yaw
    command = np.stack((distance * np.cos(bearing), 2.0 * np.sin(bearing)), axis=-1)  # [m/s, rad/s]
    worlds.step(np.clip(command, -robot.actuators.scale, robot.actuators.scale))

print(
    f"{np.mean(distance < task.tolerance.position):.0%} are within {task.tolerance.position:g} m of their goals"
)
