"""Loads a dataset with LeRobot and writes what LeRobot makes of it as JSON. Run by the Python of the peers."""

from __future__ import annotations

import json
import sys

from lerobot.datasets.lerobot_dataset import LeRobotDataset

folder = sys.argv[1]
# The wheel of PyAV brings what reads videos; LeRobot's own choice, torchcodec, needs FFmpeg on the machine.
whole = LeRobotDataset("local/whole", root=folder, video_backend="pyav")
second = LeRobotDataset("local/second", root=folder, episodes=[1], video_backend="pyav")
# Two actions of the future with each frame, as policies that predict several are trained.
ahead = LeRobotDataset(
    "local/ahead", root=folder, delta_timestamps={"action": [0.0, 2.0 / whole.fps]}, video_backend="pyav"
)
end = whole.meta.episodes[0]["dataset_to_index"] - 1
cameras = whole.meta.camera_keys
looked_at = [0, end // 2, end + 1, len(whole) - 1] if cameras else []

reported = {
    "version": whole.meta.info["codebase_version"],
    "robot_type": whole.meta.robot_type,
    "fps": whole.fps,
    "names": whole.meta.names,
    "frames": [
        {
            key: value if isinstance(value, str) else value.tolist()
            for key, value in whole[index].items()
            if key not in cameras
        }
        for index in range(len(whole))
    ],
    "episodes": [[each["dataset_from_index"], each["dataset_to_index"]] for each in whole.meta.episodes],
    "second": [len(second), second[0]["index"].item()],
    "ahead": [ahead[index]["action"].tolist() for index in (0, end)],
    "padded": [ahead[index]["action_is_pad"].tolist() for index in (0, end)],
    "stats": {key: value.tolist() for key, value in whole.meta.stats["action"].items()},
    "images": {key: [whole[index][key].tolist() for index in looked_at] for key in cameras},
    "looked_at": looked_at,
    "video_keys": whole.meta.video_keys,
    "image_stats": {key: whole.meta.stats[key]["mean"].tolist() for key in cameras},
    "task_index": whole.meta.get_task_index(whole[0]["task"]),
}
sys.stdout.write(json.dumps(reported))
