"""A controller that is a node of the user's own, outside of Fulmar: in runs, behind the adapter, in re-runs."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from fulmar_core.exit_codes import BAD_USAGE
from tests.conftest import RosDomain
from tests.ros.cli import fulmar, json_of

PAGE = Path(__file__).resolve().parents[2] / "docs" / "external-controller.md"
RUN = (
    "run",
    "turtlebot2",
    "--task",
    "go_to_position",
    "--controller",
    "external",
    "--record",
    "bag",
    "--json",
)


@contextmanager
def node(folder: Path, env: dict[str, str], *changes: tuple[str, str]) -> Iterator[None]:
    """The node of the page, with some words replaced, in a process of its own while the context lasts."""
    code = re.search(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert code is not None
    text = code.group(1)
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (folder / "steer.py").write_text(text)
    process = subprocess.Popen(
        [sys.executable, "steer.py"],
        cwd=folder,
        env=env,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        yield
    finally:
        process.kill()
        process.wait()


def test_the_node_of_the_page_reaches_its_goal_and_its_bag_answers_what_it_can(
    ros_domain: RosDomain, tmp_path: Path
) -> None:
    with node(tmp_path, ros_domain.env):
        done = fulmar(*RUN, "--lockstep", "--duration", "25", env=ros_domain.env, cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    summary = json_of(done.stdout)
    assert (summary["success"], summary["steps"], summary["watchdog_trips"]) == (True, 250, 0)
    assert summary["latency_ms"]["p50"] is not None
    assert summary["inference_ms"]["p50"] is None
