"""A command whose extra is missing says so in one line, with the command that installs it."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
import typer

from fulmar_cli import main
from fulmar_cli.installation.extras import EXTRAS
from fulmar_cli.installation.installed_as import install_command
from tests.fulmar_cli.bag_commands import POLICY
from tests.fulmar_cli.command_line import SHIPPED

pytestmark = pytest.mark.slow
ALL = tuple(EXTRAS)
# What each command is given, and the extras that it names where all are missing: none, and it works without.
GIVEN = {
    "list": ("robots", ()),
    "run": ("floating_platform", ("ros", "bags", "policy", "sim")),
    "up": ("", ("ros",)),
    "goals": ("--robot floating_platform --pose 1,0,0", ("ros",)),
    "teleop": ("floating_platform", ("ros",)),
    "estop": ("", ("ros",)),
    "status": ("", ("ros",)),
    "layout": ("floating_platform --out -", ()),
    "swap": (f"floating_platform {SHIPPED}", ("ros",)),
    "commission": ("turtlebot2 --emulate", ("ros",)),
    "faults": ("", ("ros",)),
    "train": ("floating_platform go_to_pose", ("train",)),
    "policies": ("", ("train",)),
    "export": ("runs/one --out bundle", ("policy",)),
    "import": ("agent.pt --robot turtlebot2 --task go_to_position --out bundle", ("policy",)),
    "evaluate": ("floating_platform go_to_pose", ("policy", "sim")),
    "certify": ("policy --robot floating_platform --task go_to_pose", ("policy", "sim")),
    "parity": ("floating_platform", ("sim", "policy")),
    "rates": (f"{POLICY}", ("bags",)),
    "report": (f"{POLICY}", ("bags",)),
    "identify": (f"{POLICY}", ("bags",)),
    "twin": (f"{POLICY} --out twin", ("sim", "policy", "bags", "train")),
    "demo": ("", ("ros", "sim", "policy", "bags", "view")),
    "install-tf": ("", ()),
    "install-actions": ("", ()),
    "install-px4": ("", ()),
    "install-interfaces": ("", ()),
    "install-stars": ("", ()),
    "console": ("", ("console", "ros")),
    "view": ("--foxglove", ("foxglove",)),
    "benchmark all": ("", ("view",)),
    "benchmark console": ("", ("ros", "bags", "policy", "sim", "console")),
    "benchmark pace": ("", ("bags",)),
    "benchmark avist": ("", ("sim", "policy")),
    "benchmark drift": ("", ("policy", "sim")),
    "benchmark events": ("", ("sim",)),
    "benchmark falcon": ("", ("view",)),
    "benchmark flights": ("", ("ros", "bags", "sim", "policy")),
    "benchmark inertia": ("", ("view",)),
    "benchmark endurance": ("", ("ros", "bags", "policy", "sim")),
    "benchmark latency": ("", ("ros", "bags", "policy", "sim")),
    "benchmark rans3d": ("", ("sim", "policy")),
    "benchmark roboran": ("", ("policy", "sim")),
    "benchmark throughput": ("--library torch", ("sim", "jsbsim", "train")),
    "benchmark training": ("", ("train",)),
    "benchmark estimator": ("", ("hardware",)),
    "benchmark hardware": ("", ("policy", "sim", "hardware")),
    "benchmark identify": ("", ("bags",)),
    "benchmark network": ("", ("policy", "sim")),
    "benchmark recorder": ("", ("ros",)),
    "bundle show": (SHIPPED, ()),
    "bundle keys": ("private.pem public.pem", ("policy",)),
    "bundle sign": (f"{SHIPPED} --key private.pem", ("policy",)),
    "bundle verify": (f"{SHIPPED} --trusted public.pem", ("policy",)),
    "bundle check": (SHIPPED, ("policy",)),
    "bag info": (f"{POLICY}", ("bags",)),
    "bag rerun": (f"{POLICY}", ("bags",)),
    "bag diff": (f"{POLICY} {POLICY}", ("bags",)),
    "bag export": (f"{POLICY}", ("bags",)),
    "bag recover": (f"{POLICY}", ("bags",)),
    "bag reference": ("", ("bags",)),
    "bag play": (f"{POLICY}", ("ros",)),
    "bag plot": (f"{POLICY}", ("view",)),
    "check robot": ("jetbot", ()),
    "simulation pause": ("floating_platform", ("ros",)),
    "simulation resume": ("floating_platform", ("ros",)),
    "simulation step": ("floating_platform", ("ros",)),
    "simulation rate": ("floating_platform 0.5", ("ros",)),
    "simulation disturb": ("floating_platform push", ("ros",)),
    "new robot": ("mine --like jetbot --mjcf none.xml", ("sim",)),
    "service install": ("mujoco_policy --dry-run", ("ros", "bags", "policy", "sim")),
    "service status": ("--root root", ()),
}
# Commands that would work for long, or move a robot, before they met the missing module, and each of their extras.
ALONE = [
    *(("demo", extra) for extra in ("ros", "sim", "policy", "bags", "view")),
    *(("run floating_platform", extra) for extra in ("ros", "sim", "policy", "bags")),
    ("run floating_platform --backend hardware --goal 0,0,0", "hardware"),
    *(("evaluate floating_platform go_to_pose", extra) for extra in ("sim", "policy")),
    *((f"report {POLICY}", extra) for extra in ("bags", "view")),
    ("check robot jetbot --plot plot.png", "view"),
    ("train floating_platform go_to_pose --wandb", "wandb"),
]
# Commands that write files and need no extra.
WRITE = {f"new {kind}" for kind in ("task", "controller", "driver", "estimator", "sensor")}
# `doctor` measures for seconds (test_extras_alone.py); `service remove` has nothing to remove. `benchmark
# descent` flies for minutes without any extra, and `new airframe` has a Python of its own.
ELSEWHERE = {"doctor", "service remove", "benchmark descent", "new airframe", *WRITE}


def commands(group, words=()):
    """Every command below a group, by its words."""
    for name, command in group.commands.items():
        if hasattr(command, "commands"):
            yield from commands(command, (*words, name))
        else:
            yield " ".join((*words, name))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Where the commands are given."""
    return tmp_path_factory.mktemp("without_extras")


@pytest.fixture(autouse=True)
def there(folder, monkeypatch):
    """The advice depends on the current folder."""
    monkeypatch.chdir(folder)


@pytest.fixture(scope="module")
def answers(folder):
    """Exit code and lines of each command without any extra, and of some without one extra."""
    questions = {(f"{name} {words}".strip(), ALL): None for name, (words, _) in GIVEN.items()}
    questions |= {(line, (extra,)): None for line, extra in ALONE}
    done = subprocess.run(
        [sys.executable, "-m", "tests.fulmar_cli.without_extras"],
        input=json.dumps([(line.split(), missing) for line, missing in questions]),
        # Without HOME, ROS has no folder for its logs.
        env={"PYTHONPATH": str(Path(__file__).parents[2]), "PATH": "/usr/bin:/bin", "HOME": "/tmp"},
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=100,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return dict(zip(questions, json.loads(done.stdout), strict=True))


def check_advice(answer, extras):
    """One line that names each of the extras and ends with the command that installs them."""
    code, text = answer
    assert code == 2, text
    assert text.count("\n") == 1, text
    line = re.fullmatch(
        r"fulmar: this command needs (.+), which the extras? (.+) brings?\. Run: (.+)\n", text
    )
    assert line, text
    modules, named = (re.findall(r"'(\w+)'", part) for part in line.groups()[:2])
    assert named == list(extras)
    assert all(any(module in EXTRAS[extra] for extra in extras) for module in modules)
    assert line[3] == install_command(extras, modules)


def test_every_command_is_tried():
    assert set(commands(typer.main.get_command(main.app))) == {*GIVEN, *ELSEWHERE}


@pytest.mark.parametrize("name", GIVEN)
def test_without_extras_a_command_works_or_names_what_it_needs(name, answers):
    words, extras = GIVEN[name]
    answer = answers[f"{name} {words}".strip(), ALL]
    if extras:
        check_advice(answer, extras)
    else:
        code, text = answer
        assert code == 0, text
        assert text


@pytest.mark.parametrize(("line", "extra"), ALONE)
def test_a_single_missing_extra_is_named_before_anything_begins(line, extra, answers):
    check_advice(answers[line, (extra,)], [extra])


def test_nothing_is_written_before_an_extra_is_missed(answers, folder):
    assert list(folder.iterdir()) == []
