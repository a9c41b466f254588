"""MuJoCo's models of robots, built from their YAML so that no number is written twice."""

from sim_nodes.mujoco_model.scene import RobotModel, Scene, build_model, robot_model_of
from sim_nodes.mujoco_model.scenery import BODY, IMU_SITE

__all__ = ["BODY", "IMU_SITE", "RobotModel", "Scene", "build_model", "robot_model_of"]
