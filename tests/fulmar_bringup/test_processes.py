"""Command lines of nodes, and children that never outlive their parent's wish."""

from __future__ import annotations

import os
import signal
import sys
import time
from dataclasses import replace
from pathlib import Path

import psutil
import pytest
import yaml

from fulmar_bringup import processes
from fulmar_bringup.node_spec import NodeSpec
from fulmar_bringup.processes import YIELDING, Ended, ProcessGroup, child_environment, command_line
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.system_rows import system_rows
from fulmar_core.config.yielding import AUTOGROUP, BEHIND


def spec(**parameters) -> NodeSpec:
    return NodeSpec("plant", "sim_nodes", "sim_node", "sim_nodes.sim_node", "/boat", parameters)


def test_a_node_is_started_as_a_module_of_this_very_interpreter():
    assert command_line(spec())[:4] == [sys.executable, "-m", "sim_nodes.sim_node", "--ros-args"]


def test_namespace_and_name_are_remapped():
    assert command_line(spec())[4:] == ["-r", "__ns:=/boat", "-r", "__node:=plant"]


def test_only_a_node_of_ours_can_be_started_as_one_that_gives_way():
    helper = replace(spec(), module="fulmar_ros.recorder_node")
    assert command_line(helper, yielding=True)[2:5] == [YIELDING, helper.module, "--ros-args"]
    assert command_line(helper)[2:4] == [helper.module, "--ros-args"]
    assert command_line(spec(), yielding=True) == command_line(spec())


@pytest.mark.parametrize(
    "value",
    [
        True, False, 0, -3, 5.0, 0.02, 1e-05, 1e30, [1.0, -2.5, 90.0], "mujoco", "", "true", "5", "5.0", "null", "~",
        "it's", "a: b # c", '{"json": [1, "two"]}', "/a path/with spaces", "tilde ~ & * ! % @ `", "back\\slash", "ünï",
    ],
)  # fmt: skip
def test_every_value_comes_through_yaml_as_itself_and_as_its_own_type(value):
    argument = command_line(spec(key=value))[-1]
    name, _, text = argument.partition(":=")
    # ROS reads YAML 1.2 numbers as C does; PyYAML needs a dot before the exponent.
    read = float(text) if isinstance(value, float) else yaml.safe_load(text)
    assert name == "key"
    assert read == value
    assert type(read) is type(value)


def test_children_stay_on_this_machine_and_know_their_parent(monkeypatch):
    monkeypatch.delenv("ROS_AUTOMATIC_DISCOVERY_RANGE", raising=False)
    environment = child_environment()
    assert environment["ROS_AUTOMATIC_DISCOVERY_RANGE"] == "LOCALHOST"
    assert int(environment["FULMAR_PARENT_PID"]) == psutil.Process().pid
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET")
    assert child_environment()["ROS_AUTOMATIC_DISCOVERY_RANGE"] == "SUBNET"


@pytest.mark.parametrize(
    ("code", "text"),
    [
        (0, "plant ended with exit code 0"),
        (3, "plant ended with exit code 3"),
        (-9, "plant was killed by SIGKILL"),
        (None, "plant could not be ended"),
    ],
)
def test_how_a_child_ended_is_said_in_words(code, text):
    assert Ended("plant", code).text == text


@pytest.fixture
def start(tmp_path, monkeypatch):
    """Start small programs as if they were nodes."""
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    group = ProcessGroup()

    def start(name, program, **more):
        (tmp_path / f"{name}_program.py").write_text(program)
        group.start(NodeSpec(name, "x", "x", f"{name}_program", "/x", **more))
        return group

    yield start
    group.stop_all()


def wait_for(condition):
    deadline = time.monotonic() + 10.0
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.02)


def test_output_of_a_child_is_prefixed_with_its_name(start, capfd):
    group = start("talker", "print('hello')")
    wait_for(group.ended)
    wait_for(lambda: "[talker] hello" in capfd.readouterr().err)


def test_the_end_of_an_optional_child_is_no_end(start):
    group = start("markers", "raise SystemExit(3)", optional=True)
    group.process("markers").wait(10.0)
    assert group.ended() is None
    assert [(end.returncode, end.optional) for end in group.stop_all()] == [(3, True)]


def test_a_child_is_started_again_in_its_place_also_where_it_hangs(start):
    start("first", "import time; time.sleep(60)")
    group = start("second", "import time; time.sleep(60)")
    hangs = group.process("first")
    hangs.suspend()
    wait_for(lambda: group.is_stopped("first"))
    group.start_again(group.specs["first"])
    assert not hangs.is_running()
    assert group.process("first").pid != hangs.pid
    assert not group.is_stopped("first")
    assert list(group.specs) == ["first", "second"]  # which is stopped last, and first


NICE_VALUES = """
import os, pathlib, sys
from fulmar_core.config.yielding import AUTOGROUP, take_place

def nice():
    return os.getpriority(os.PRIO_PROCESS, 0)

def of_session():
    group = pathlib.Path(AUTOGROUP)
    return group.read_text().split()[-1] if group.exists() else "none"

IMPORTED = nice()

def main():
    print(sys.argv[1:3])
    before = of_session()
    take_place()
    print("nice", IMPORTED, nice(), before, of_session())

if __name__ == "__main__":
    main()
"""


def test_a_child_that_is_started_again_gives_way_while_it_imports_its_modules_and_not_later(
    start, capfd, monkeypatch
):
    monkeypatch.setattr(processes, "GLUE", "")
    group = start("helper", NICE_VALUES)
    group.process("helper").wait(10.0)
    words = [group.last_words("helper", ended=True)]
    group.start_again(group.specs["helper"])
    group.process("helper").wait(10.0)
    words.append(group.last_words("helper", ended=True))
    own = os.getpriority(os.PRIO_PROCESS, 0)
    lower = min(own + BEHIND, 19)
    kernel_shares = Path(AUTOGROUP).exists()
    sessions = [("0", "0"), (str(BEHIND), "0")] if kernel_shares else [("none", "none")] * 2
    assert words == [
        f"nice {own} {own} {' '.join(sessions[0])}",
        f"nice {lower} {own} {' '.join(sessions[1])}",
    ]
    assert capfd.readouterr().err.count("['--ros-args', '-r']") == 2


def test_a_child_that_gives_way_and_cannot_be_imported_ends_with_its_error(start, monkeypatch):
    monkeypatch.setattr(processes, "GLUE", "")
    group = start("helper", "raise ValueError('no such thing')")
    group.process("helper").wait(10.0)
    group.start_again(group.specs["helper"])
    assert group.process("helper").wait(10.0) == 1
    assert group.last_words("helper", ended=True) == "ValueError: no such thing"


def test_the_last_words_of_a_child_are_printed_before_stop_returns(start, capfd):
    group = start("talker", "print('x\\n' * 20000 + '[ERROR] [12.3] [boat.plant]: too deep')")
    wait_for(group.ended)
    group.stop("talker")
    assert "[boat.plant]: too deep" in capfd.readouterr().err
    assert group.last_words("talker") == "too deep"


def test_a_child_is_not_held_up_by_an_output_that_nobody_takes(start, monkeypatch, tmp_path):
    closed = (tmp_path / "closed").open("w")
    closed.close()
    monkeypatch.setattr(sys, "stderr", closed)
    group = start("talker", "print('a long line of output\\n' * 20000); raise SystemExit(4)")
    wait_for(group.ended)
    assert group.ended() == Ended("talker", 4)


def test_a_stop_that_is_interrupted_forgets_no_child(start, monkeypatch, tmp_path):
    group = start("sleeper", "import time\ntime.sleep(60)\n")
    with monkeypatch.context() as context:
        context.setattr(psutil, "wait_procs", interrupt)
        with pytest.raises(KeyboardInterrupt):
            group.stop("sleeper")
    assert [end.name for end in group.stop_all()] == ["sleeper"]


def interrupt(*_args, **_kwargs):
    raise KeyboardInterrupt


def test_a_child_that_ended_is_found_with_its_code(start):
    group = start("quitter", "raise SystemExit(3)")
    wait_for(group.ended)
    assert group.ended() == Ended("quitter", 3)


def test_a_child_that_sleeps_is_asked_to_stop_and_does(start, tmp_path):
    ready = tmp_path / "ready"
    group = start(
        "sleeper",
        "import pathlib, signal, sys, time\n"
        "signal.signal(signal.SIGTERM, lambda *_: sys.exit(5))\n"
        f"pathlib.Path({str(ready)!r}).touch()\n"
        "time.sleep(60)\n",
    )
    wait_for(ready.exists)
    assert group.stop("sleeper") == [Ended("sleeper", 5)]
    assert group.ended() is None


@pytest.mark.parametrize(
    ("patience_s", "end"), [(0.1, Ended("writer", -9, forced=True)), (10.0, Ended("writer", 0))]
)
def test_a_child_has_the_time_that_its_row_gives_it_to_write_what_it_holds(start, tmp_path, patience_s, end):
    ready = tmp_path / "ready"
    group = start(
        "writer",
        "import pathlib, signal, sys, time\n"
        "signal.signal(signal.SIGTERM, lambda *_: (time.sleep(0.5), sys.exit(0)))\n"
        f"pathlib.Path({str(ready)!r}).touch()\n"
        "time.sleep(60)\n",
        patience_s=patience_s,
    )
    wait_for(ready.exists)
    assert group.stop("writer") == [end]


def test_a_recorder_has_more_time_to_end_than_what_moves_a_robot():
    plan = RunPlan("floating_platform", "go_to_pose", "lqr", "mujoco", 50.0)
    rows = system_rows(plan, record={})
    assert rows["recorder"].patience_s > rows["plant"].patience_s == rows["controller"].patience_s


def test_a_child_that_still_imports_its_modules_ends_without_a_word(start, tmp_path, capfd):
    ready = tmp_path / "ready"
    group = start("importer", f"import pathlib, time\npathlib.Path({str(ready)!r}).touch()\ntime.sleep(60)\n")
    wait_for(ready.exists)
    assert group.stop("importer") == [Ended("importer", -signal.SIGTERM)]
    assert "Traceback" not in "".join(capfd.readouterr())


def test_a_child_that_was_stopped_in_its_tracks_is_killed_without_delay(start, tmp_path):
    ready = tmp_path / "ready"
    group = start("frozen", f"import time, pathlib\npathlib.Path({str(ready)!r}).touch()\ntime.sleep(60)\n")
    wait_for(ready.exists)
    # Other tests of the session may have left helpers of multiprocessing.
    (child,) = (each for each in psutil.Process().children() if "frozen_program" in " ".join(each.cmdline()))
    child.suspend()
    wait_for(lambda: child.status() == psutil.STATUS_STOPPED)
    began = time.monotonic()
    assert group.stop("frozen") == [Ended("frozen", -9, forced=True)]
    assert time.monotonic() - began < 3.0


def test_a_child_whose_start_was_interrupted_is_stopped_all_the_same(start, monkeypatch):
    def interrupted(relay):
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(processes._Relay, "start", interrupted)
        with pytest.raises(KeyboardInterrupt):
            start("slow", "import time; time.sleep(60)")
    group = start("other", "import time; time.sleep(60)")
    assert {ended.name for ended in group.stop_all()} == {"slow", "other"}
