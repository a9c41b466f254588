"""`system.launch.py` starts what the node table lists.

`launch` and `launch_ros` do not exist as wheels, so small stand-ins note what is built from them.
"""

from __future__ import annotations

import importlib.util
import sys
from dataclasses import dataclass, field
from types import ModuleType

import pytest

from fulmar_bringup import launched_system
from fulmar_core.config.paths import config_names

ARGUMENTS = {
    "system", "robot", "task", "controller", "backend", "hardware", "policy", "goals", "adapter", "topic",
    "emulate", "name", "markers", "camera", "actions", "simulation_interfaces", "broadcast",
}  # fmt: skip

ARGUMENTS_HELP = launched_system.ARGUMENTS


class Built:
    """Keeps the arguments of its construction."""

    def __init__(self, *args, **kwargs):
        self.args = args
        self.kwargs = kwargs


class LaunchConfiguration(Built):
    """Reads a launch argument; the context is a plain dict here."""

    def perform(self, context):
        return context[self.args[0]]


@dataclass(frozen=True)
class Row:
    """One row of the node table, with the fields of a NodeSpec."""

    name: str = "plant"
    package: str = "sim_nodes"
    executable: str = "sim_node"
    module: str = "sim_nodes.sim_node"
    namespace: str = "platform"
    parameters: dict = field(default_factory=lambda: {"control_hz": 5.0, "lockstep": True, "seed": 7})
    remappings: dict = field(default_factory=dict)
    loss: str = "ends"
    ends_within_s: float = 0.0


STAND_INS = {
    "launch": {"LaunchContext": Built, "LaunchDescription": type("LaunchDescription", (Built,), {})},
    "launch.actions": {
        name: type(name, (Built,), {}) for name in ("DeclareLaunchArgument", "OpaqueFunction", "Shutdown")
    },
    "launch.substitutions": {"LaunchConfiguration": LaunchConfiguration},
    "launch_ros": {},
    "launch_ros.actions": {"Node": type("Node", (Built,), {})},
    "launch_ros.parameter_descriptions": {"ParameterValue": type("ParameterValue", (Built,), {})},
}


CHECKED = []  # rows that were looked for in the ROS domain before they were started


def stand_in(monkeypatch, name, **attributes):
    module = ModuleType(name)
    vars(module).update(attributes)
    monkeypatch.setitem(sys.modules, name, module)


@pytest.fixture
def load(repository, monkeypatch):
    """Function that loads the launch file."""
    monkeypatch.setattr("fulmar_bringup.launch_check.refuse_living_plants", CHECKED.append)
    for name, attributes in STAND_INS.items():
        stand_in(monkeypatch, name, **attributes)

    def load_launch_file():
        path = repository / "ros2_ws/src/fulmar_bringup/launch/system.launch.py"
        spec = importlib.util.spec_from_file_location("system_launch", path)
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return module

    return load_launch_file


@pytest.fixture
def launch_with(load, monkeypatch):
    """Function that launches rows with arguments: (requested system, started nodes)."""

    def launch(*rows, **arguments):
        asked = {}

        def list_nodes(**kwargs):
            asked.update(kwargs)
            return rows

        stand_in(
            monkeypatch, "fulmar_bringup.launched_system", list_nodes=list_nodes, ARGUMENTS=ARGUMENTS_HELP
        )
        return asked, start(load(), arguments)

    return launch


def start(launch_file, arguments):
    """Nodes that `ros2 launch` would start with these arguments."""
    entities = launch_file.generate_launch_description().args[0]
    context = {
        e.args[0]: e.kwargs["default_value"] for e in entities if type(e).__name__ == "DeclareLaunchArgument"
    }
    assert set(context) == ARGUMENTS
    (opaque,) = [e for e in entities if type(e).__name__ == "OpaqueFunction"]
    return opaque.kwargs["function"](context | arguments)


def test_missing_arguments_are_none(launch_with):
    asked, _ = launch_with(Row())
    assert asked == dict.fromkeys(ARGUMENTS)


def test_arguments_reach_the_node_table(launch_with):
    given = {name: f"some_{name}" for name in ARGUMENTS}
    asked, _ = launch_with(Row(), **given)
    assert asked == given


def test_every_row_of_the_table_becomes_one_node(launch_with):
    rows = [Row(), Row(name="controller", package="policy_server", executable="controller_node")]
    _, nodes = launch_with(*rows)
    assert [type(node).__name__ for node in nodes] == ["Node", "Node"]
    for row, node in zip(rows, nodes, strict=True):
        given = node.kwargs
        assert (given["package"], given["executable"]) == (row.package, row.executable)
        assert (given["name"], given["namespace"]) == (row.name, row.namespace)
        assert given["parameters"] == [row.parameters]
        assert given["output"] == "screen"


def test_a_running_plant_of_the_same_name_is_searched_for_before_the_start(launch_with):
    CHECKED.clear()
    launch_with(Row())
    assert [(Row(),)] == CHECKED


def test_a_node_without_parameters_gets_no_empty_parameter_file(launch_with):
    _, (node,) = launch_with(Row(parameters={}))
    assert node.kwargs["parameters"] == []


def test_a_text_that_looks_like_a_number_stays_a_text(launch_with):
    _, (node,) = launch_with(Row(parameters={"task": "7", "seed": 7}))
    (parameters,) = node.kwargs["parameters"]
    assert parameters["seed"] == 7
    assert parameters["task"].args == ("7",)
    assert parameters["task"].kwargs == {"value_type": str}


def test_the_end_of_a_node_ends_the_launch(launch_with):
    _, nodes = launch_with(Row(), Row(name="controller"))
    for node in nodes:
        assert type(node.kwargs["on_exit"]).__name__ == "Shutdown"
        assert node.kwargs["name"] in node.kwargs["on_exit"].kwargs["reason"]


def test_a_helper_that_ends_is_started_again_and_does_not_end_the_launch(launch_with):
    _, (helper, plant) = launch_with(Row(name="recorder", loss="restarts"), Row())
    assert helper.kwargs["on_exit"] == []
    assert helper.kwargs["respawn"]
    assert not plant.kwargs["respawn"]


def test_a_plant_that_lands_first_gets_the_time_for_it(launch_with):
    _, (lands, stops) = launch_with(Row(ends_within_s=304.0), Row(name="controller"))
    assert lands.kwargs["sigterm_timeout"] == "304.0"
    assert "sigterm_timeout" not in stops.kwargs


def test_the_launch_arguments_are_those_of_the_launched_system():
    assert set(launched_system.ARGUMENTS) == ARGUMENTS


QUICK = ("mock_lqr", "mujoco_lab")  # simulated, and with motion capture; every other one is like one of them


@pytest.mark.parametrize(
    "system",
    [pytest.param(name, marks=() if name in QUICK else pytest.mark.slow) for name in config_names("systems")],
)
def test_every_system_launches_the_nodes_of_the_table(load, system):
    from fulmar_bringup.launched_system import list_nodes

    launched = [
        (node.kwargs["package"], node.kwargs["executable"], node.kwargs["name"])
        for node in start(load(), {"system": system})
    ]
    listed = [(spec.package, spec.executable, spec.name) for spec in list_nodes(system=system)]
    assert launched == listed
    assert launched
