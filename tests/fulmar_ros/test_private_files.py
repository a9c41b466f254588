"""What a node writes is read by its own user alone."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from fulmar_ros.runtime import keep_private

MAKER = """
import os, sys, rclpy
from rclpy.node import Node
from fulmar_ros.runtime import run_node

class Maker(Node):
    def __init__(self, request_exit):
        super().__init__("maker")
        os.mkdir(sys.argv[1])
        open(os.path.join(sys.argv[1], "file"), "w").close()
        request_exit(0)

sys.exit(run_node(Maker))
"""


@pytest.fixture
def usual_umask():
    before = os.umask(0o022)
    yield
    os.umask(before)


def test_a_stricter_umask_stays(usual_umask):
    os.umask(0o177)
    keep_private()
    assert os.umask(0o022) == 0o177


def test_files_and_folders_of_a_node_have_no_rights_for_others(ros_domain, usual_umask, tmp_path):
    folder = tmp_path / "made"
    subprocess.run([sys.executable, "-c", MAKER, str(folder)], check=True, timeout=60)
    assert folder.stat().st_mode & 0o777 == 0o700
    assert (folder / "file").stat().st_mode & 0o777 == 0o600
