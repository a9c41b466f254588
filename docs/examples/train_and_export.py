"""Half a minute of learning, and a bundle that the node on the robot runs without torch; needs `make dev`."""

from pathlib import Path

from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task
from fulmar_evaluation.evaluation import evaluate_trial
from fulmar_evaluation.trial_plan import plan_trial
from training.jobs import Job, run_job
from training.settings import load_training_settings

robot, task, bundle = "floating_platform", "go_to_pose", Path("runs/bundles/mine")
settings = load_training_settings(load_robot(robot), load_task(task))
run_job(Job("mine", robot, task, 1, settings, Path("runs/train/mine"), time_limit_s=30.0, bundle=bundle))

trial = plan_trial(robot=robot, task=task, controller="policy", policy=bundle, through="mujoco", episodes=32)
print(f"{bundle}: {evaluate_trial(trial)['success_rate']:.0%} reach the pose in MuJoCo")
