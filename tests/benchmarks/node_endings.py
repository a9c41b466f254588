"""Starts and stops nodes many times, two at once beside a busy process, and counts those that end badly.

    .venv/bin/python tests/benchmarks/node_endings.py --times 500

Each node is asked to end by SIGTERM, after a time drawn from a seed: while it starts, or while it works. A node ends
badly if a signal ends it or the allocator complains.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from fulmar_bringup.domains import reserved_domains
from fulmar_bringup.processes import child_environment

ROBOT = ["-p", "robot:=floating_platform"]
NODES = {
    "plant": ["sim_nodes.sim_node", *ROBOT, "-p", "backend:=mock"],
    "controller": [
        "policy_server.controller_node",
        *ROBOT,
        "-p",
        "task:=go_to_pose",
        "-p",
        "controller:=lqr",
    ],
    "estimator": ["fulmar_ros.estimator_node", *ROBOT, "-p", "estimator:=mocap_imu"],
    "recorder": ["fulmar_ros.recorder_node", "-p", "directory:=DIRECTORY"],
}
LIVES_S = (0.3, 3.0)  # from the start of a process to its end; a node needs about 1.5 s to be up
ALLOCATOR = ("malloc", "free()", "corrupt", "double free", "munmap_chunk")


def stopped(name: str, number: int, lives_s: float, env: dict[str, str], folder: Path) -> str:
    """Start a node and stop it; why its end was bad, or an empty text."""
    arguments = [word.replace("DIRECTORY", str(folder / f"bag_{number}")) for word in NODES[name]]
    node = subprocess.Popen(
        [sys.executable, "-m", arguments[0], "--ros-args", "-r", "__ns:=/floating_platform", *arguments[1:]],
        env=env,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    time.sleep(lives_s)
    node.send_signal(signal.SIGTERM)
    try:
        out, _ = node.communicate(timeout=30.0)
    except subprocess.TimeoutExpired:
        node.kill()
        node.communicate()
        return f"{name}: did not end within 30 s"
    text = out.decode(errors="replace")
    # SIGTERM itself ends a process before its handler is installed.
    if node.returncode < 0 and node.returncode != -signal.SIGTERM:
        return f"{name}: {signal.Signals(-node.returncode).name}: {text[-300:]}"
    if any(word in text for word in ALLOCATOR):
        return f"{name}: {text[-300:]}"
    return ""


def main() -> None:
    """Print the count of ends and the bad ones as JSON; exit code 1 if there are bad ones."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--times", type=int, default=50, help="starts of each node")
    parser.add_argument("--seed", type=int, default=0, help="of how long each node lives")
    parser.add_argument("--nodes", default=",".join(NODES), help="which, by name")
    asked = parser.parse_args()
    names = asked.nodes.split(",")
    rng = random.Random(asked.seed)
    cases = [(name, rng.uniform(*LIVES_S)) for _ in range(asked.times) for name in names]
    busy = subprocess.Popen([sys.executable, "-c", "while True: pass"])
    try:
        with tempfile.TemporaryDirectory() as folder, reserved_domains(1) as (domain,):
            env = {**os.environ, **child_environment(), "ROS_DOMAIN_ID": str(domain)}
            with ThreadPoolExecutor(2) as pool:
                ends = pool.map(
                    lambda case: stopped(case[1][0], case[0], case[1][1], env, Path(folder)), enumerate(cases)
                )
                bad = [end for end in ends if end]
    finally:
        busy.kill()
        busy.wait()
    sys.stdout.write(json.dumps({"ends": Counter(name for name, _ in cases), "bad": bad}, indent=2) + "\n")
    sys.exit(1 if bad else 0)


if __name__ == "__main__":
    main()
