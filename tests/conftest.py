"""Fixtures of all tests: a DDS domain per test, synthetic runs, the command line."""

from __future__ import annotations

import contextlib
import functools
import gc
import os
import shutil
import signal
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

# Before numpy is loaded: threads of linear algebra that wait for each other take a third of all processor time.
os.environ.update(dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1"))

import pytest
import typer.testing

from fulmar_bringup.domains import reserved_domains
from fulmar_cli import main as command_line
from fulmar_ros.middleware import LOOPBACK, PROFILES
from tests.fulmar_cli.bag_commands import POLICY
from tests.read_once import read_once
from tests.real_time_first import RealTimeFirstPlugin
from tests.synthetic_run import CALM, Plan, write_run


@dataclass(frozen=True)
class RosDomain:
    """A DDS domain that no other running test shares, on this host only."""

    id: int
    env: dict[str, str]  # environment of every process in it


def pytest_addoption(parser: pytest.Parser) -> None:
    """`--seeds 20` repeats random tests: pytest tests/ros/test_six_nozzles.py --seeds 20."""
    parser.addoption("--seeds", type=int, default=1, help="seeds of each test that takes `seed_of_series`")


def pytest_configure(config: pytest.Config) -> None:
    """Run tests with wall-clock deadlines first, in one process; read what Fulmar comes with once."""
    # As the Makefile does: each process and hundreds of their children would compile the same modules again.
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    sys.dont_write_bytecode = False
    config.pluginmanager.register(RealTimeFirstPlugin(), "real_time_first")
    patch = pytest.MonkeyPatch()
    config.add_cleanup(patch.undo)
    read_once(patch)


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Run a test with the argument `seed_of_series` with each seed from 1 on."""
    if "seed_of_series" in metafunc.fixturenames:
        metafunc.parametrize("seed_of_series", range(1, metafunc.config.getoption("seeds") + 1))


# Robots and tasks that differ from another by figures alone: where a test has both, they are left to `make test-all`.
ALIKE = {
    "microsat": "cubesat_wheels",
    "smallsat": "cubesat_wheels",
    "jetbot": "turtlebot2",
    "a0s": "airship_v7",
    "volantex_ranger": "airship_v7",
    "navion": "airship_v7",
    "navion_falcon": "airship_v7",
    "cessna_182": "airship_v7",
    "skywalker_x8": "airship_v7",
    "sr22": "airship_v7",
    "floating_platform_roboran": "floating_platform",
    **dict.fromkeys(("fly_b", "fly_c", "fly_d", "fly_e", "fly_f"), "fly_a"),
    "fly_recover": "fly_attitude",
}


def parameter_names(item: pytest.Item) -> dict[tuple[str, str], str]:
    """Names of robots and tasks among the parameters of a test, by the test and the parameter."""
    parameters = item.callspec.params if hasattr(item, "callspec") else {}
    named = {
        key: value if isinstance(value, str) else getattr(value, "name", "")
        for key, value in parameters.items()
    }
    return {
        (item.nodeid.partition("[")[0], key): str(name)
        for key, name in named.items()
        if isinstance(name, str)
    }


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark tests of robots and tasks that are like another one of the same test as slow."""
    found = {(key, name) for item in items for key, name in parameter_names(item).items()}
    for item in items:
        if any((key, ALIKE.get(name)) in found for key, name in parameter_names(item).items()):
            item.add_marker(pytest.mark.slow)


def pytest_collection_finish() -> None:
    """Exclude imported modules from the garbage collection between tests of ROS nodes."""
    gc.collect()
    gc.freeze()


@pytest.fixture(autouse=True)
def ordinary_threads() -> Iterator[None]:
    """Take the priority away that the loop of a node took in this process: it would hold up every test to come."""
    yield
    if sys.platform != "linux" or os.sched_getscheduler(0) in (os.SCHED_OTHER, os.SCHED_IDLE):
        return
    for thread in map(int, os.listdir("/proc/self/task")):
        with contextlib.suppress(OSError):  # it may have ended
            os.sched_setscheduler(thread, os.SCHED_OTHER, os.sched_param(0))


@pytest.fixture(autouse=True, scope="session")
def interruptible() -> None:
    """Let children receive SIGINT also in the background of a shell, and SIGHUP also below nohup; both ignore them."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


@pytest.fixture(autouse=True, scope="session")
def one_command_line() -> Iterator[None]:
    """Build the commands once: in each call of a command line they would take most of its time."""
    built = functools.cache(typer.main.get_command)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("typer.main.get_command", built)
        patch.setattr("typer.testing._get_command", built)
        yield


@pytest.fixture(autouse=True, scope="session")
def unlogged_learners(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Put the empty log folders of learners among pytest's temporary folders."""
    os.environ["SB3_LOGDIR"] = str(tmp_path_factory.mktemp("learners"))


@pytest.fixture
def ros_domain(monkeypatch: pytest.MonkeyPatch) -> Iterator[RosDomain]:
    """A DDS domain for this test; the test's own process gets its variables too.

    Ended lifecycle nodes of this process stay visible in their domain until they are garbage-collected, so nodes of
    this process freeze nothing. No plant searches for another one before it starts, since there is none.
    """
    unchanged = SimpleNamespace(**dict.fromkeys(("collect", "freeze", "unfreeze"), lambda: None))
    monkeypatch.setattr("fulmar_ros.runtime.gc", unchanged)
    monkeypatch.setattr("fulmar_ros.plant_node.BRIEFLY_S", 0.0)
    gc.collect()
    gc.freeze()  # modules that earlier tests imported would take a quarter of a second at each collection
    with reserved_domains(1) as (number,):
        own = {"ROS_DOMAIN_ID": str(number), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
        own |= dict.fromkeys(PROFILES, str(LOOPBACK))  # the middleware reads it once in a process
        for name, value in own.items():
            monkeypatch.setenv(name, value)
        yield RosDomain(number, {**os.environ, **own})


@pytest.fixture(scope="session")
def reached(tmp_path_factory) -> Path:
    """A run that reached its goal."""
    return write_run(tmp_path_factory.mktemp("runs") / "reached", Plan())


@pytest.fixture(scope="session")
def calm(tmp_path_factory) -> Path:
    """The same run with other gains, recorded as a policy."""
    return write_run(tmp_path_factory.mktemp("runs") / "calm", Plan(controller="policy", weights=CALM))


@pytest.fixture(scope="session")
def silenced(tmp_path_factory) -> Path:
    """A run whose controller stops publishing for good."""
    return write_run(
        tmp_path_factory.mktemp("runs") / "silenced", Plan(duration_s=15.0, silence_s=(8.0, 15.1))
    )


@pytest.fixture
def copy_of(tmp_path) -> Callable[[Path], Path]:
    """Function that copies a bag, for tests that damage it."""

    def copy(bag: Path) -> Path:
        return Path(shutil.copytree(bag, tmp_path / bag.name))

    return copy


@pytest.fixture
def copy(tmp_path) -> Path:
    """A copy of a reference bag, for tests that change it."""
    return Path(shutil.copytree(POLICY, tmp_path / "bag"))


@pytest.fixture
def fulmar(monkeypatch, capsys):
    """Run a command line in this process: exit code, standard output, standard error."""

    def call(*words: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["fulmar", *map(str, words)])
        with pytest.raises(SystemExit) as ended:
            command_line.main()
        captured = capsys.readouterr()
        return int(ended.value.code or 0), captured.out, captured.err

    return call
