"""ROS packages: manifests, symlinks, versions, programs.

colcon silently treats a package with a faulty manifest as plain Python, without build order.
"""

from __future__ import annotations

import ast
import configparser
import os
import re
import tomllib

import grimp
import pytest
from catkin_pkg.package import parse_package

from fulmar_cli.installation.extras import EXTRAS
from tests.architecture.conftest import PACKAGES

ROS = set(EXTRAS["ros"])  # rclpy and the packages of messages


@pytest.fixture(scope="module")
def packages(repository):
    return repository / "ros2_ws" / "src"


@pytest.fixture(scope="module")
def imports(repository):
    """Import graph of all packages and their external imports."""
    return grimp.build_graph(*PACKAGES, include_external_packages=True, cache_dir=None)


def programs(folder):
    """Console scripts of one setup.py as (program, module); where it asks for them, every node is one."""
    text = (folder / "setup.py").read_text()
    asked = (folder / folder.name).glob("*_node.py") if '{node}:main" for node in NODES' in text else ()
    nodes = sorted(path.stem for path in asked if "def main(" in path.read_text())
    return re.findall(r'"(\w+) = ([\w.]+):main"', text) + [(node, f"{folder.name}.{node}") for node in nodes]


def test_the_workspace_has_exactly_these_packages(packages):
    assert sorted(path.parent.name for path in packages.glob("*/package.xml")) == PACKAGES


@pytest.mark.parametrize("name", PACKAGES)
def test_every_package_xml_is_ament_python(packages, name):
    warnings: list[str] = []
    package = parse_package(str(packages / name / "package.xml"), warnings=warnings)
    package.validate(warnings=warnings)
    assert warnings == []
    assert package.name == name
    assert package.package_format == 3
    assert package.get_build_type() == "ament_python"
    assert package.licenses == ["Apache-2.0"]


@pytest.mark.parametrize("name", PACKAGES)
def test_every_package_has_the_version_of_the_distribution(repository, packages, name):
    project = tomllib.loads((repository / "pyproject.toml").read_text())["project"]
    assert parse_package(str(packages / name)).version == project["version"]


@pytest.mark.parametrize("name", PACKAGES)
def test_every_package_declares_what_it_imports(packages, imports, name):
    manifest = parse_package(str(packages / name))
    declared = {dependency.name for dependency in manifest.exec_depends}
    modules = {name} | imports.find_descendants(name)
    imported = {
        target.partition(".")[0]
        for module in modules
        for target in imports.find_modules_directly_imported_by(module)
    }
    assert imported & (set(PACKAGES) | ROS) - {name} <= declared


@pytest.mark.parametrize("name", PACKAGES)
def test_setup_cfg_installs_programs_where_ros2_searches(packages, name):
    parser = configparser.ConfigParser(interpolation=None)
    parser.read(packages / name / "setup.cfg")
    assert parser["develop"]["script_dir"] == f"$base/lib/{name}"
    assert parser["install"]["install_scripts"] == f"$base/lib/{name}"
    # Without this line the programs would carry the interpreter of the machine that built them.
    assert parser["build_scripts"]["executable"] == "/usr/bin/env python3"


@pytest.mark.parametrize("name", PACKAGES)
def test_every_package_has_its_index_marker(packages, name):
    assert (packages / name / "resource" / name).is_file()


@pytest.mark.parametrize("name", PACKAGES)
def test_every_program_leads_to_a_main_function(packages, name):
    for program, module in programs(packages / name):
        source = packages / name / (module.replace(".", "/") + ".py")
        assert source.is_file(), f"{program} of {name} needs {module}"
        body = ast.parse(source.read_text()).body
        # Defined here or brought in by an import: both can be called.
        names = {node.name for node in body if isinstance(node, ast.FunctionDef)}
        names |= {
            alias.asname or alias.name
            for node in body
            if isinstance(node, ast.ImportFrom)
            for alias in node.names
        }
        assert "main" in names, f"{module} has no main()"


def test_programs_are_those_that_systems_start(packages):
    found = {(name, program) for name in PACKAGES for program, _ in programs(packages / name)}
    assert found == {
        ("fulmar_cli", "fulmar"),
        ("fulmar_ros", "estimator_node"),
        ("fulmar_ros", "estop_node"),
        ("fulmar_ros", "action_node"),
        ("fulmar_ros", "broadcast_node"),
        ("fulmar_ros", "simulation_interfaces_node"),
        ("fulmar_ros", "goal_node"),
        ("fulmar_ros", "markers_node"),
        ("fulmar_ros", "recorder_node"),
        ("fulmar_ros", "teleop_node"),
        ("hardware_drivers", "adapter_node"),
        ("hardware_drivers", "driver_node"),
        ("policy_server", "controller_node"),
        ("sim_nodes", "camera_node"),
        ("sim_nodes", "emulator_node"),
        ("sim_nodes", "event_camera_node"),
        ("sim_nodes", "fleet_node"),
        ("sim_nodes", "sim_node"),
    }


def test_every_symlink_is_relative_and_has_a_target(repository, packages):
    links = [path for path in packages.glob("*/*") if path.is_symlink()]
    assert {link.relative_to(packages).as_posix() for link in links} == {
        "fulmar_core/configs",
        "hardware_drivers/hardware_drivers",
        "policy_server/policy_server",
        "sim_nodes/sim_nodes",
    }
    for link in links:
        assert not os.readlink(link).startswith("/"), link
        assert link.resolve() == repository / link.name
        assert link.is_dir(), link
