"""The ROS workspace builds with colcon, and the installation works without the checkout."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.architecture.conftest import PACKAGES

PROGRAMS = {
    "fulmar_cli/fulmar": "fulmar_cli.main",
    "fulmar_ros/estimator_node": "fulmar_ros.estimator_node",
    "fulmar_ros/estop_node": "fulmar_ros.estop_node",
    "fulmar_ros/action_node": "fulmar_ros.action_node",
    "fulmar_ros/broadcast_node": "fulmar_ros.broadcast_node",
    "fulmar_ros/goal_node": "fulmar_ros.goal_node",
    "fulmar_ros/markers_node": "fulmar_ros.markers_node",
    "fulmar_ros/recorder_node": "fulmar_ros.recorder_node",
    "fulmar_ros/simulation_interfaces_node": "fulmar_ros.simulation_interfaces_node",
    "fulmar_ros/teleop_node": "fulmar_ros.teleop_node",
    "hardware_drivers/adapter_node": "hardware_drivers.adapter_node",
    "hardware_drivers/driver_node": "hardware_drivers.driver_node",
    "policy_server/controller_node": "policy_server.controller_node",
    "sim_nodes/camera_node": "sim_nodes.camera_node",
    "sim_nodes/emulator_node": "sim_nodes.emulator_node",
    "sim_nodes/event_camera_node": "sim_nodes.event_camera_node",
    "sim_nodes/fleet_node": "sim_nodes.fleet_node",
    "sim_nodes/sim_node": "sim_nodes.sim_node",
}
SOURCES = ["configs", "hardware_drivers", "policy_server", "ros2_ws/src", "sim_nodes"]

pytestmark = [pytest.mark.slow, pytest.mark.timeout(120)]


class Workspace:
    """A copy of the needed parts of the tree, outside of the checkout."""

    def __init__(self, folder: Path, repository: Path) -> None:
        self.root = folder / "ros2_ws"
        self.install = self.root / "install"
        for source in SOURCES:
            shutil.copytree(
                repository / source,
                folder / source,
                symlinks=True,
                ignore=shutil.ignore_patterns("__pycache__"),
            )
        # Only this interpreter's folder is added, so that `env python3` finds what the tests run on.
        foreign = ("AMENT_", "COLCON_", "PYTHONPATH", "FULMAR_")
        self.environment = {key: value for key, value in os.environ.items() if not key.startswith(foreign)}
        self.environment["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])

    def colcon(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        """Run colcon in the workspace."""
        return self._run([str(Path(sys.executable).with_name("colcon")), *arguments], self.root)

    def sourced(self, command: str) -> subprocess.CompletedProcess[str]:
        """Run a shell command after sourcing the installation."""
        return self._run(["bash", "-c", f"source ./local_setup.bash && {command}"], self.install)

    def _run(self, command: list[str], folder: Path) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            command,
            cwd=folder,
            env=self.environment,
            capture_output=True,
            text=True,
            check=False,
            timeout=100,
        )


@pytest.fixture(scope="module")
def workspace(repository, tmp_path_factory):
    return Workspace(tmp_path_factory.mktemp("colcon"), repository)


@pytest.fixture(scope="module")
def built(workspace):
    result = workspace.colcon("build", "--base-paths", "src")
    assert result.returncode == 0, result.stdout + result.stderr
    assert f"{len(PACKAGES)} packages finished" in result.stdout
    return workspace


def files_below(folder):
    """Files below a folder, relative to it, without compiled ones."""
    return {
        path.relative_to(folder).as_posix()
        for path in folder.rglob("*")
        if path.is_file() and path.suffix not in {".pyc", ".md"}
    }


def test_colcon_finds_ament_python_packages(workspace):
    lines = workspace.colcon("list", "--base-paths", "src").stdout.splitlines()
    found = {line.split("\t")[0]: line.split("\t")[2] for line in lines}
    assert found == dict.fromkeys(PACKAGES, "(ros.ament_python)")


def test_packages_are_built_from_the_core_to_the_command_line(workspace):
    order = workspace.colcon(
        "list", "--base-paths", "src", "--names-only", "--topological-order"
    ).stdout.split()
    assert order[:3] == ["fulmar_core", "fulmar_bags", "fulmar_ros"]
    upper = ["fulmar_bringup", "fulmar_evaluation", "fulmar_console", "fulmar_benchmarks", "fulmar_cli"]
    assert order[-5:] == upper


@pytest.mark.parametrize("name", PACKAGES)
def test_every_package_is_in_the_index(built, name):
    share = built.install / name / "share"
    assert (share / "ament_index/resource_index/packages" / name).is_file()
    assert (share / name / "package.xml").is_file()


@pytest.mark.parametrize("name", PACKAGES)
def test_every_source_file_and_policy_is_installed(built, repository, name):
    (site,) = (built.install / name).glob("lib/python*/site-packages")
    assert files_below(site / name) == files_below(repository / "ros2_ws" / "src" / name / name)


def test_every_config_is_installed_in_share(built, repository):
    share = built.install / "fulmar_core/share/fulmar_core"
    assert files_below(share / "configs") == files_below(repository / "configs")
    assert files_below(share / "configs")


def test_the_launch_file_is_installed_in_share(built):
    assert (built.install / "fulmar_bringup/share/fulmar_bringup/launch/system.launch.py").is_file()


def test_the_installed_core_reads_the_installed_configs(built):
    code = "import fulmar_core.config.paths as p; print(p.__file__); print(p.config_directory())"
    result = built.sourced(f"python3 -c '{code}'")
    assert result.returncode == 0, result.stderr
    for line in result.stdout.splitlines():
        assert Path(line).is_relative_to(built.install)


def test_programs_are_where_ros2_run_searches(built):
    found = {
        path.relative_to(built.install / name / "lib").as_posix()
        for name in PACKAGES
        for path in (built.install / name / "lib" / name).glob("*")
    }
    assert found == set(PROGRAMS)


@pytest.mark.parametrize("program", PROGRAMS)
def test_every_program_uses_the_interpreter_of_the_shell(built, program):
    package = program.partition("/")[0]
    script = built.install / package / "lib" / program
    assert os.access(script, os.X_OK)
    assert script.read_text().splitlines()[0] == "#!/usr/bin/env python3"


@pytest.mark.parametrize(("program", "module"), PROGRAMS.items())
def test_every_program_finds_its_installed_main(built, program, module):
    code = f"import {module} as m; print(m.__file__, callable(m.main))"
    result = built.sourced(f"python3 -c '{code}'")
    assert result.returncode == 0, result.stderr
    file, _, can_be_called = result.stdout.strip().splitlines()[-1].rpartition(" ")
    assert Path(file).is_relative_to(built.install)
    assert can_be_called == "True"


def test_the_installed_command_line_runs(built):
    result = built.sourced("fulmar_cli/lib/fulmar_cli/fulmar --help")
    assert result.returncode == 0, result.stderr
    assert re.search(r"usage", result.stdout, re.IGNORECASE)
