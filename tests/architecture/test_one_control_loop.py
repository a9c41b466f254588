"""Nodes, re-runs and evaluations call the one control loop, and no controller or task themselves."""

from __future__ import annotations

import ast

import pytest

PACKAGES = ("ros2_ws/src", "policy_server", "sim_nodes", "hardware_drivers")
STEPS = ("act", "observe")
LOOPS = {"loop", "guard"}  # names of a `ControlLoop` and a `GuardedLoop`, private or not
CORE = "ros2_ws/src/fulmar_core/fulmar_core"
WRITTEN = {
    f"{CORE}/loop/control_loop.py": "the step itself",
    f"{CORE}/loop/guarded_loop.py": "the same behind its guards",
    f"{CORE}/tasks/observation.py": "what the step observes with",
    f"{CORE}/simulation/simulation.py": "the batch that learners step",
    f"{CORE}/simulation/learning_step.py": "a step of a learner",
    "ros2_ws/src/fulmar_benchmarks/fulmar_benchmarks/throughput.py": "measures that one",
    "ros2_ws/src/fulmar_benchmarks/fulmar_benchmarks/guard/defects.py": "a controller with a defect on top of another",
    "ros2_ws/src/fulmar_benchmarks/fulmar_benchmarks/guard/moving_defects.py": "the same of boats and wheels",
    "ros2_ws/src/fulmar_benchmarks/fulmar_benchmarks/guard/wing_defects.py": "the same of wings",
    "policy_server/policy.py": "inputs of a network beside its observation",
    "policy_server/own_controller.py": "a user's class behind the interface of controllers",
    f"{CORE}/tasks/go_to_position_with_obstacles.py": "a part of what its task observes",
    f"{CORE}/tasks/own_task.py": "tries a user's own task before anything moves",
}


def receiver(call):
    """Last name of what a method is called on."""
    value = call.func.value
    return getattr(value, "attr", getattr(value, "id", ""))


def own_steps(tree):
    """Calls of a controller, a task or an observer outside of a loop."""
    named = {
        id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Attribute) and node.attr == "names"
    }
    found = []
    for node in ast.walk(tree):
        if not isinstance(node, ast.Call):
            continue
        if isinstance(node.func, ast.Attribute) and node.func.attr in STEPS:
            if receiver(node).strip("_").removesuffix("ed") not in LOOPS:
                found.append(f"line {node.lineno}: .{node.func.attr}()")
        elif isinstance(node.func, ast.Name) and node.func.id == "Observer" and id(node) not in named:
            found.append(f"line {node.lineno}: Observer()")
    return found


def test_no_other_file_calls_a_controller_or_an_observer(repository):
    found, seen = {}, set()
    for package in PACKAGES:
        for path in sorted((repository / package).rglob("*.py")):
            steps = own_steps(ast.parse(path.read_text(encoding="utf-8")))
            name = str(path.relative_to(repository))
            if name in WRITTEN:
                seen.add(name)
            elif steps:
                found[name] = steps
    assert found == {}
    assert seen == set(WRITTEN)


@pytest.mark.parametrize(
    ("code", "count"),
    [
        ("command = self._controller.act(inputs)", 1),
        ("terms = task.observe(state, goal)", 1),
        ("seen = Observer(robot, task)(state, goal, before)", 1),
        ("done = guard.act(self._guarded.observe(measurement))", 0),
        ("names = Observer(robot, task).names", 0),
    ],
)
def test_a_call_outside_of_a_loop_is_found(code, count):
    assert len(own_steps(ast.parse(code))) == count
