"""In strange surroundings a command works, or says in one line what is wrong and what to do; `doctor` always works."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from fulmar_core.config.errors import BAD_USAGE, DONE, FAILED
from tests.conftest import RosDomain
from tests.fulmar_cli.bag_commands import POLICY

RUN = "run turtlebot2 --task go_to_position --goal 1,0 --controller classical --lockstep --duration 1"
COMMANDS = {
    "doctor": "doctor --for sim",
    "run": f"{RUN} --record bag",
    "report": f"report {POLICY} --out report.html",
}
WORKS, MISSED = "", (DONE, FAILED)  # a run of one second misses its goal
READ_ONLY = "mount --bind / / && mount -o remount,bind,ro / &&"
MAY_MOUNT = (
    shutil.which("unshare")
    and not subprocess.run(["unshare", "--mount", "true"], capture_output=True).returncode
)


@dataclass(frozen=True)
class Surroundings:
    """What a command is started in, and what it says; it works where nothing is given."""

    variables: Mapping[str, str | None] = field(default_factory=dict)  # None: not set
    before: str = ""  # of the command, in a shell
    after: str = ""
    mounts: str = ""  # words of a shell that may mount
    files: tuple[str, ...] = ()  # of the current folder
    says: Mapping[str, str] = field(default_factory=dict)  # what a command needs, by its name


def without_ros(words: str) -> dict[str, str]:
    """What the commands that need ROS say."""
    return {"doctor": words, "run": words}


SURROUNDINGS = {
    "plain": Surroundings(),
    "no HOME": Surroundings({"HOME": None}, says=without_ros("HOME is not set")),
    "a HOME that is not there": Surroundings(
        {"HOME": "/proc/no"}, says=without_ros("logs into /proc/no/.ros/log, by HOME")
    ),
    "a log folder that cannot be written": Surroundings(
        {"ROS_LOG_DIR": "/proc/no"}, says=without_ros("logs into /proc/no, by ROS_LOG_DIR")
    ),
    "all is read-only": Surroundings(
        mounts=READ_ONLY,
        says={
            "doctor": "Read-only file system",
            "run": "cannot write",
            "report": "set the MPLCONFIGDIR",
        },
    ),
    "the C locale": Surroundings({"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}),
    "a latin-1 locale": Surroundings(
        {"LC_ALL": "en_US.ISO-8859-1", "LOCPATH": "{here}/locales", "PYTHONUTF8": "0"}
    ),
    "another middleware": Surroundings(
        {"RMW_IMPLEMENTATION": "rmw_cyclonedds_cpp"}, says=without_ros("this ROS has rmw_fastrtps_cpp only")
    ),
    "a sourced ROS of another Python": Surroundings(
        {"PYTHONPATH": "{here}/ros/lib/python3.99/site-packages:{path}"},
        files=(
            "ros/lib/python3.99/site-packages/rclpy/__init__.py",
            "ros/lib/python3.99/site-packages/numpy.py",
        ),
        says=without_ros("PYTHONPATH has an rclpy of another Python"),
    ),
    "a folder with modules": Surroundings(
        files=(
            "random.py",
            "yaml.py",
            "serial.py",
            "mcap/__init__.py",
            "rclpy.py",
            "numpy/__init__.py",
            "signal.py",
        )
    ),
    "PYTHONPATH with an empty part": Surroundings(
        {"PYTHONPATH": ":{path}"}, files=("yaml.py", "serial.py", "mcap/__init__.py", "rclpy.py", "typer.py")
    ),
    "40 columns": Surroundings({"COLUMNS": "40", "LINES": "10"}),
    "no colour": Surroundings({"NO_COLOR": "1", "TERM": "dumb"}),
    "closed output": Surroundings(after=">&-"),
    "all closed": Surroundings(after="<&- >&- 2>&-"),
    "a reader that has ended": Surroundings(after="| true"),
    "64 files": Surroundings(before="ulimit -n 64 &&"),
    "a small /dev/shm": Surroundings(mounts="mount -t tmpfs -o size=8k tmpfs /dev/shm &&"),
    "a private umask": Surroundings(before="umask 0077 &&"),
    "an open umask": Surroundings(before="umask 0 &&"),
}


def start(
    where: Surroundings, words: str, folder: Path, domain: RosDomain
) -> subprocess.CompletedProcess[str]:
    """Run a command in its surroundings."""
    for name in where.files:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text("raise SystemExit('a file of the user was run')\n")
    path = os.pathsep.join(each for each in sys.path if each and "python3." not in each)
    environment = {**domain.env, "PYTHONPATH": path}
    for name, value in where.variables.items():
        environment.pop(name, None)
        if value is not None:
            environment[name] = value.format(here=folder, path=path)
    code = "import sys; from fulmar_cli.main import main; sys.argv[0] = 'fulmar'; main()"
    command = f'{where.before} "{sys.executable}" -P -c "{code}" {words} {where.after}'
    shell = (
        ["unshare", "--mount", "bash", "-c", where.mounts + command]
        if where.mounts
        else ["bash", "-c", command]
    )
    return subprocess.run(
        shell, cwd=folder, env=environment, capture_output=True, text=True, errors="replace", timeout=120.0
    )


def check(name: str, command: str, done: subprocess.CompletedProcess[str], folder: Path) -> None:
    """Compare the end of a command with what its surroundings let it do."""
    where, said = SURROUNDINGS[name], done.stdout + done.stderr
    assert "Traceback" not in said, said
    assert "a file of the user was run" not in said
    words = where.says.get(command, WORKS)
    assert words in said
    if command == "doctor":
        first, found = done.stdout.partition("\n")[0], done.stdout.count("\n")
        assert done.returncode == (FAILED if words else DONE), said
        assert where.after or found > 10
        assert first.startswith("wrong  ROS: ") or "ROS" not in words
    elif words:
        assert done.returncode in (FAILED, BAD_USAGE)
        assert said.splitlines()[-1].startswith("fulmar: "), said
    else:
        assert done.returncode in MISSED, said
        assert (folder / {"run": "bag/metadata.yaml", "report": "report.html"}[command]).exists()


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Where the commands are given, with a locale of Latin-1 in it."""
    here = tmp_path / "here"
    (here / "locales").mkdir(parents=True)
    return here


@pytest.mark.slow
@pytest.mark.timeout(200)
@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("name", SURROUNDINGS)
def test_a_command_works_or_says_what_to_do(
    name: str, command: str, folder: Path, ros_domain: RosDomain
) -> None:
    where = SURROUNDINGS[name]
    if where.mounts and not MAY_MOUNT:
        pytest.skip("this user may not mount")
    if "LOCPATH" in where.variables:
        made = ["localedef", "-f", "ISO-8859-1", "-i", "en_US", str(folder / "locales" / "en_US.ISO-8859-1")]
        if not shutil.which("localedef") or subprocess.run(made, capture_output=True).returncode:
            pytest.skip("this computer makes no locales")
    check(name, command, start(where, COMMANDS[command], folder, ros_domain), folder)
