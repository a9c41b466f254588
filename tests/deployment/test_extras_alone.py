"""The wheel with one extra in an environment of its own: what needs only that works, the rest names what is missing.

The environment gets what the wheel's metadata asks for, from that of the tests, so that no network is needed.
"""

from __future__ import annotations

import contextlib
import email
import os
import subprocess
import venv
import zipfile
from collections.abc import Iterable
from importlib.metadata import distribution
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from tests.fulmar_cli.bag_commands import POLICY
from tests.fulmar_cli.command_line import SHIPPED

MUJOCO = "evaluate floating_platform go_to_pose --through mujoco --episodes 1"
# What needs only this extra, as arguments of `fulmar`, or as modules.
WORKS = {
    "": "check robot jetbot",
    "ros": "import rclpy, fulmar_ros.goal_node; rclpy.init()",
    "sim": f"{MUJOCO} --controller lqr",
    "policy": f"bundle check {SHIPPED}",
    "bags": f"bag info {POLICY}",
    "hardware": "import filterpy.kalman, serial, gpiod, hardware_drivers.mavlink_driver",
    "view": "check robot jetbot --plot plot.png",
    "run": MUJOCO,
    "datasets": "import pyarrow.parquet, av",
    "train": "import training.learners, training.export",
    "cluster": "import ray",
    "wandb": "import wandb",
}
IN_RUN = ("ros", "sim", "policy", "bags", "hardware", "view")
DEMO = ("ros", "sim", "policy", "bags", "view")
BRINGS = {"hardware": {"hardware", "view"}}  # filterpy needs Matplotlib

pytestmark = [pytest.mark.slow, pytest.mark.timeout(300)]


def needed(requirements: Iterable[str], extra: str, done: set[tuple[str, str]]) -> set[str]:
    """Distributions that some requirements ask for, with all that those ask for."""
    names = set()
    for line in requirements:
        asked = Requirement(line)
        if asked.marker and not asked.marker.evaluate({"extra": extra}):
            continue
        names.add(asked.name)
        for one in ("", *asked.extras):
            if (asked.name, one) not in done:
                done.add((asked.name, one))
                names |= needed(distribution(asked.name).requires or (), one, done)
    return names - {"fulmar"}


def link(name: str, target: Path) -> None:
    """Put a distribution's modules into an environment."""
    for file in distribution(name).files or ():
        if "bin" not in file.parts and "__pycache__" not in file.parts:
            (target / file).parent.mkdir(parents=True, exist_ok=True)
            with contextlib.suppress(FileExistsError):
                os.link(file.locate(), target / file)


@pytest.fixture(params=WORKS, ids=lambda extra: extra or "base")
def environment(request, wheel, tmp_path):
    """An extra, and a Python with the wheel and that extra."""
    venv.create(tmp_path / "env", with_pip=False, symlinks=True)
    (packages,) = (tmp_path / "env" / "lib").glob("python3*/site-packages")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(packages)
        (name,) = (one for one in archive.namelist() if one.endswith(".dist-info/METADATA"))
        metadata = email.message_from_bytes(archive.read(name))
    extras = IN_RUN if request.param == "run" else (request.param,)
    for asked in {one for extra in extras for one in needed(metadata.get_all("Requires-Dist"), extra, set())}:
        link(asked, packages)
    return request.param, tmp_path / "env" / "bin" / "python"


def call(python: Path, words: str) -> subprocess.CompletedProcess[str]:
    """Run `fulmar` or a statement, in an empty folder."""
    folder = python.parents[2] / "empty"
    folder.mkdir(exist_ok=True)
    arguments = ["-c", words] if words.startswith("import") else ["-m", "fulmar_cli.main", *words.split()]
    variables = {"PATH": "/usr/bin:/bin", "HOME": str(folder), "LANG": "C.UTF-8"}
    return subprocess.run(
        [python, *arguments],
        cwd=folder,
        env=variables,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=200,
        check=False,
    )


def test_an_extra_alone_does_its_work_and_the_rest_is_named(environment):
    extra, python = environment
    for words in ("--help", "list robots", WORKS[extra]):
        done = call(python, words)
        assert done.returncode == 0, f"{words}: {done.stdout}{done.stderr}"
    missing = call(python, "train floating_platform go_to_pose" if extra == "run" else "demo")
    assert missing.returncode == 2, missing.stdout + missing.stderr
    assert missing.stderr.count("\n") == 1, missing.stderr
    for other in ("train",) if extra == "run" else DEMO:
        assert (f"'{other}'" in missing.stderr) == (other not in BRINGS.get(extra, {extra})), missing.stderr
    assert "Run: uv pip install" in missing.stderr
