"""Every node ends its part of the middleware before its process ends.

A thread of DDS that still runs while the process tears down what it uses corrupts memory, now and then.
"""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from fulmar_core.config.errors import BAD_USAGE, DONE
from tests.conftest import RosDomain

# Watches over shared memory for all participants of a process; the middleware joins it when it is unloaded.
OUTLIVES = "dds.shm.wdog"
# Runs a node's module, asks for its end as soon as it spins, and prints the threads that its end leaves.
WRAPPER = """
import json, os, runpy, signal, sys
from fulmar_ros import runtime

settle, alive = runtime.settle_memory, []
def settle_and_end():
    settle()
    alive.extend(threads())
    os.kill(os.getpid(), signal.SIGTERM)
def threads():
    return sorted(open(f"/proc/self/task/{task}/comm").read().strip() for task in os.listdir("/proc/self/task"))
runtime.settle_memory = settle_and_end
sys.argv = sys.argv[1:]
try:
    runpy.run_module(sys.argv[0], run_name="__main__")
except SystemExit as end:
    print(json.dumps({"code": end.code, "alive": alive, "left": threads()}))
"""
ROBOT = {"robot": "floating_platform"}
LQR = {**ROBOT, "task": "go_to_pose", "controller": "lqr"}
NODES = {
    "controller": ("policy_server.controller_node", LQR),
    "plant": ("sim_nodes.sim_node", {**ROBOT, "backend": "mock"}),
    "estimator": ("fulmar_ros.estimator_node", {**ROBOT, "estimator": "mocap_imu"}),
    "recorder": ("fulmar_ros.recorder_node", {"directory": "bag"}),
    "estop": ("fulmar_ros.estop_node", ROBOT),
    "markers": ("fulmar_ros.markers_node", {**ROBOT, "task": "go_to_pose"}),
    "teleop": ("fulmar_ros.teleop_node", {**ROBOT, "keyboard": "false"}),
    "camera": ("sim_nodes.camera_node", {"robot": "cubesat_8"}),
    "event camera": ("sim_nodes.event_camera_node", {"robot": "cubesat_wheels"}),
}
QUICK = ("controller",)


def ended(
    module: str, parameters: dict[str, str], *, domain: RosDomain, folder: Path
) -> dict[str, list[str] | int]:
    """Run a node to its end; its exit code, and its threads before and after."""
    given = [word for key, value in parameters.items() for word in ("-p", f"{key}:={value}")]
    done = subprocess.run(
        [sys.executable, "-c", WRAPPER, module, "--ros-args", "-r", "__ns:=/floating_platform", *given],
        env=domain.env,
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=60.0,
        check=False,
        stdin=subprocess.DEVNULL,
    )
    assert done.returncode != -signal.SIGABRT, done.stderr
    found: dict[str, list[str] | int] = json.loads(done.stdout.splitlines()[-1])
    return found


def of_dds(threads: list[str] | int) -> list[str]:
    """Threads that send or receive."""
    assert isinstance(threads, list)
    return [name for name in threads if name.startswith("dds.") and name != OUTLIVES]


@pytest.mark.parametrize(
    "name", [name if name in QUICK else pytest.param(name, marks=pytest.mark.slow) for name in NODES]
)
def test_no_thread_of_the_middleware_outlives_a_node(
    name: str, ros_domain: RosDomain, tmp_path: Path
) -> None:
    module, parameters = NODES[name]
    found = ended(module, parameters, domain=ros_domain, folder=tmp_path)
    assert found["code"] == DONE
    assert of_dds(found["alive"])
    assert of_dds(found["left"]) == []


@pytest.mark.slow
def test_no_thread_of_the_middleware_outlives_a_node_that_is_refused(
    ros_domain: RosDomain, tmp_path: Path
) -> None:
    module, _ = NODES["controller"]
    found = ended(module, {**LQR, "control_hz": "-1.0"}, domain=ros_domain, folder=tmp_path)
    assert found["code"] == BAD_USAGE
    assert of_dds(found["left"]) == []


HANGS = """
import ctypes
from fulmar_ros import runtime

def hang(node):
    ctypes.PyDLL(None).sleep(60)  # with Python's lock, as the middleware did

runtime._destroy, runtime.DESTROYED_S = hang, 1.0
with runtime.ros_node("hangs", print):
    pass
"""


def test_a_process_whose_middleware_hangs_at_its_end_ends_with_the_place(ros_domain) -> None:
    done = subprocess.run(
        [sys.executable, "-c", HANGS],
        env=ros_domain.env,
        capture_output=True,
        text=True,
        timeout=30,
        check=False,
    )
    assert done.returncode != 0
    assert "in hang" in done.stderr
