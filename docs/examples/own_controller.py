"""A controller of your own, evaluated in the batch and in MuJoCo; `--controller own_controller:Hover` runs it, too."""

import numpy as np

from fulmar_evaluation.evaluation import evaluate_trial
from fulmar_evaluation.trial_plan import plan_trial


class Hover:
    """Pushes a spacecraft to its goal, without turning: opens the valves that push that way."""

    def __init__(self, robot, task, settings):
        self.force, self.torque = np.split(robot.actuators.wrench_per_newton, 2, axis=1)  # (16, 3) [N, N·m]

    def reset(self):
        """Begin an episode."""

    def act(self, inputs):
        """Commands of all robots, shape (n, 16): each valve open or closed."""
        to_goal, _, velocity, rate = np.split(inputs.observation, (3, 7, 10), axis=1)  # [m, -, m/s, rad/s]
        force, torque = 0.3 * to_goal - 1.5 * velocity, -0.2 * rate
        return (force @ self.force.T + 3.0 * torque @ self.torque.T > 0.02).astype(float)


if __name__ == "__main__":
    for through in ("batch", "mujoco"):
        trial = plan_trial(
            robot="spacecraft_16",
            task="go_to_position_3d",
            controller="own_controller:Hover",
            through=through,
            episodes=16,
        )
        print(f"{through}: {evaluate_trial(trial)['success_rate']:.0%} reach the position")
