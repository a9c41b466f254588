"""Writes a dataset with LeRobot itself, to compare its layout with ours. Run by the Python of the peers."""

from __future__ import annotations

import json
import sys

import numpy as np
from lerobot.datasets.lerobot_dataset import LeRobotDataset

folder, info = sys.argv[1], json.loads(sys.argv[2])
own = ("observation.state", "action", "next.done")
features = {key: {**info["features"][key], "shape": tuple(info["features"][key]["shape"])} for key in own}
dataset = LeRobotDataset.create(
    "local/own", info["fps"], features, root=folder, robot_type=info["robot_type"], use_videos=False
)
for episode in range(2):
    for _ in range(3):
        frame = {key: np.zeros(features[key]["shape"], features[key]["dtype"]) for key in own}
        dataset.add_frame({**frame, "task": f"task {episode}"})
    dataset.save_episode()
dataset.finalize()
