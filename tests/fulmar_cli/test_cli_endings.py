"""How the command ends as a process: exit codes, signals, readers that go away, and what it never loads."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys

import pytest

from tests.fulmar_cli.command_line import EVALUATE, SHIPPED
from tests.own_files import own_folder


@pytest.mark.parametrize(
    ("number", "reported"), [(signal.SIGTERM, "stopped by SIGTERM"), (signal.SIGINT, "stopped by the user")]
)
def test_a_command_that_is_reported_to_stop_says_so_and_ends_with_1(fulmar, monkeypatch, number, reported):
    monkeypatch.setattr("fulmar_evaluation.evaluation.batches", lambda *_a, **_k: signal.raise_signal(number))
    before = signal.getsignal(signal.SIGTERM)
    try:
        code, out, err = fulmar(*EVALUATE)
    finally:
        signal.signal(signal.SIGTERM, before)
    assert (code, out, err) == (1, "", f"fulmar: {reported}\n")


def test_a_place_that_cannot_be_written_is_a_failure_in_one_line(fulmar, tmp_path):
    pytest.importorskip("stable_baselines3")
    blocked = tmp_path / "file"
    blocked.write_text("")
    code, out, err = fulmar("train", "floating_platform", "go_to_pose", "--out", str(blocked))
    assert (code, out) == (1, "")
    assert err == f"fulmar: {blocked}: File exists.\n"


COMMAND = [sys.executable, "-m", "fulmar_cli.main"]


def test_the_installed_command_does_the_same_in_a_process_of_its_own():
    done = subprocess.run(
        [*COMMAND, "list", "robots", "--json"], capture_output=True, text=True, timeout=30, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert "floating_platform" in json.loads(done.stdout)["robots"]


def test_a_mistake_gets_one_line_from_the_installed_command_too():
    done = subprocess.run([*COMMAND, "run", "boat"], capture_output=True, text=True, timeout=30, check=False)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize("words", [f"bundle show {SHIPPED} --json", "list robots"], ids=["a lot", "a little"])
def test_a_reader_that_has_had_enough_gets_no_traceback(words):
    piped = f"{sys.executable} -m fulmar_cli.main {words} | true; exit ${{PIPESTATUS[0]}}"
    done = subprocess.run(["bash", "-c", piped], capture_output=True, text=True, timeout=30, check=False)
    assert done.stderr == ""
    assert done.returncode in (0, 1)  # 0 where all was written before the reader went


def test_looking_around_loads_neither_ros_nor_torch_nor_a_simulator():
    program = (
        "import sys; sys.argv = ['fulmar', 'list', '--json']\n"
        "from fulmar_cli import main as cli\n"
        "try: cli.main()\n"
        "except SystemExit: pass\n"
        "heavy = {'rclpy', 'torch', 'mujoco', 'onnxruntime', 'matplotlib', 'scipy'} & set(sys.modules)\n"
        "sys.exit(f'loaded {heavy}' if heavy else 0)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=30, check=False
    )
    assert done.returncode == 0, done.stderr


CATCHES_AN_INTERRUPT_OF_TEXT_THAT_RUNS_AS_CODE = """
import os, signal
from fulmar_cli import main as cli

def app(**_):
    try:
        exec("os.kill(os.getpid(), signal.SIGINT)\\nwhile True: pass")
    except KeyboardInterrupt:
        return 1

cli.app = app
cli.main()
"""


def test_a_ctrl_c_that_was_answered_does_not_end_the_process_by_a_signal_afterwards(tmp_path):
    (tmp_path / "interrupted.py").write_text(CATCHES_AN_INTERRUPT_OF_TEXT_THAT_RUNS_AS_CODE)
    ended = subprocess.run([sys.executable, "-m", "interrupted"], cwd=tmp_path, timeout=30.0, check=False)
    assert ended.returncode == 1


@pytest.mark.parametrize("closed", [">&-", "<&- >&- 2>&-"])
def test_closed_streams_lead_nowhere_and_no_file_takes_their_place(closed, tmp_path):
    layout = tmp_path / "view.rviz"
    command = f"{sys.executable} -m fulmar_cli.main layout turtlebot2 --out {layout} {closed}"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, timeout=30, check=False)
    assert done.stdout == ""
    assert done.stderr == "" or done.stderr.startswith("fulmar: standard output is closed")
    assert (done.stderr == "") == ("2>" in closed)
    assert "wrote" not in layout.read_text()


def test_a_locale_without_a_character_gets_a_question_mark_in_its_place(tmp_path):
    command = [sys.executable, "-m", "fulmar_cli.main", "list", "\u20ac\udcff"]
    environment = {**os.environ, "LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    done = subprocess.run(command, env=environment, capture_output=True, timeout=30, check=False)
    assert done.returncode == 2
    assert b"Traceback" not in done.stderr
    assert done.stderr.count(b"\n") == 1


PRINTS = """
import os, subprocess, sys
from fulmar_bringup.console import json_alone, print_json
with json_alone():
    print("a class of a user")
    os.write(1, b"a library\\n")
    subprocess.run([sys.executable, "-c", "print('a worker')"])
    print_json({"a": 1}, indent=None)
print("later")
"""


def test_nothing_but_json_goes_to_the_output_whoever_prints():
    command = [sys.executable, "-c", PRINTS]
    done = subprocess.run(command, capture_output=True, text=True, timeout=30, check=True)
    assert done.stdout == '{"a": 1}\nlater\n'
    assert set(done.stderr.splitlines()) == {"a class of a user", "a library", "a worker"}


PRINTING = """
import numpy as np
print("loaded")
class Steer:
    def __init__(self, robot, task, settings):
        print("made")
        self.count = len(robot.actuators.names)
    def reset(self): print("reset")
    def act(self, inputs):
        print("acts")
        return np.zeros((len(inputs.state.x), self.count))
"""


def test_json_of_an_evaluation_is_one_object_whatever_the_controller_prints(fulmar, tmp_path, monkeypatch):
    with own_folder(tmp_path, monkeypatch):
        (tmp_path / "own_printing.py").write_text(PRINTING)
        asked = ("turtlebot2", "go_to_position", "--controller", "own_printing:Steer")
        code, out, err = fulmar("evaluate", *asked, "--through", "batch", "--episodes", 2, "--json")
    assert code == 0, err
    assert json.loads(out)["episodes"] == 2
    assert {"loaded", "made", "acts"} <= set(err.splitlines())


def test_paths_of_results_are_never_folded(fulmar, tmp_path):
    folder = tmp_path / ("a_long_name_" * 12)
    code, out, _ = fulmar("export", "navion", "--to", "jsbsim", "--out", folder)
    assert code == 0
    assert [line.partition(":")[0] for line in out.splitlines()] == [
        str(folder / "aircraft" / "navion" / "navion.xml"),
    ]
