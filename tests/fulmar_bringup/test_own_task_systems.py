"""A system file names a task and a controller of the user's own; its rows and its bag carry the names."""

from __future__ import annotations

import json
import re
from pathlib import Path

from fulmar_bringup.launched_system import list_nodes
from fulmar_core.config.paths import OWN_FOLDERS
from tests.own_files import own_folder

PAGE = Path(__file__).resolve().parents[2] / "docs" / "own-task.md"
SYSTEM = """
title: a base that circles
robot: turtlebot2
task: my_task:Circle
controller: my_orbit:Orbit
backend: mujoco
control_hz: 10
"""


def test_a_system_file_of_the_user_s_own_starts_nodes_with_task_and_controller(tmp_path, monkeypatch):
    task, controller, *_ = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    (tmp_path / "my_task.py").write_text(task)
    (tmp_path / "my_orbit.py").write_text(controller)
    (tmp_path / "systems").mkdir()
    (tmp_path / "systems" / "circling.yaml").write_text(SYSTEM)
    monkeypatch.setenv(OWN_FOLDERS, str(tmp_path))
    with own_folder(tmp_path, monkeypatch):
        recorder, plant, node, _markers = list_nodes(system="circling")
    assert plant.parameters["task"] == node.parameters["task"] == "my_task:Circle"
    assert node.parameters["controller"] == "my_orbit:Orbit"
    carried = json.loads(str(recorder.parameters["attachments"]))
    assert carried["task.py"] == str(tmp_path / "my_task.py")
    assert "task.yaml" not in carried
