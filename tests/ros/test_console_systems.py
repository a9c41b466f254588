"""Robots of each kind, driven through the console's source as a page does: goal, stop, reset, swap, restart."""

from __future__ import annotations

import contextlib
import math
import signal
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import psutil
import pytest

from fulmar_console.live.live_source import LiveSource
from fulmar_console.source import RobotSample
from tests.conftest import RosDomain
from tests.ros.cli import FULMAR, child_running
from tests.ros.console_page import Page
from tests.ros.neighbour import until

pytestmark = pytest.mark.slow

HALF = math.sqrt(0.5)
FOUND_S, FLIES_S = 40.0, 90.0
SYSTEMS = {
    "floating_platform": (("mock_lqr",), {"targets": [[1.0, 0.5, 0.0, 0.0, 0.0, HALF, HALF]]}),
    "kingfisher": (("--robot", "kingfisher"), {"targets": [[1.5, 0.5, 0.0, 0.0, 0.0, 0.0, 1.0]]}),
    "spacecraft_16": (("mujoco_spacecraft",), {"targets": [[0.5, 0.2, -0.3, 0.0, 0.0, 0.0, 1.0]]}),
    "cubesat_wheels": (("mujoco_satellite", "--rate", "5"), {"targets": [[0.0] * 5 + [HALF, HALF]]}),
}


class Watched:
    """The console's source beside a system."""

    def __init__(self, robot: str) -> None:
        self.source = LiveSource()
        self.source.start()
        self.page = Page(self.source.do, robot)
        self.robot = robot

    @property
    def health(self) -> dict:
        return dict(self.source.health().get(self.robot, {}))

    @property
    def record(self) -> dict:
        return next((each for each in self.source.robots() if each["name"] == self.robot), {})

    @property
    def sample(self) -> RobotSample | None:
        index = self.record.get("index")
        return next((each for each in self.source.frame()[0] if each.index == index), None)

    def runs(self) -> bool:
        """Whether it is known, moves as far as the page sees, and its controller waits or acts."""
        sample, health = self.sample, self.health
        return sample is not None and sample.age_s < 1.0 and "controller" in health and not health["estop"]

    def wait(self, condition: Callable[[], bool], seconds: float = FOUND_S) -> None:
        try:
            until(condition, seconds)
        except AssertionError:
            raise AssertionError(f"not within {seconds} s: {self.health}, {self.sample}") from None


@pytest.fixture
def watched(ros_domain: RosDomain) -> Iterator[Callable[[str], Watched]]:
    made: list[Watched] = []

    def watch(robot: str) -> Watched:
        made.append(Watched(robot))
        return made[-1]

    yield watch
    for each in made:
        each.source.close()


@pytest.fixture
def up(ros_domain: RosDomain, tmp_path: Path) -> Iterator[Callable[..., psutil.Popen]]:
    """Starts systems; none outlives its test."""
    started: list[psutil.Popen] = []

    def start(*arguments: str) -> psutil.Popen:
        where = tmp_path / str(len(started))
        where.mkdir()
        with (where / "log").open("w") as log:
            process = psutil.Popen(
                [*FULMAR, "up", *arguments, "--json"],
                env=ros_domain.env, cwd=where, stdin=subprocess.DEVNULL, stdout=log, stderr=log,
            )  # fmt: skip
        started.append(process)
        return process

    yield start
    for process in started:
        with contextlib.suppress(psutil.NoSuchProcess):
            process.send_signal(signal.SIGINT)
    for process in started:
        try:
            process.wait(20.0)
        except psutil.TimeoutExpired:
            process.kill()


@pytest.mark.parametrize("robot", SYSTEMS)
def test_a_goal_of_the_page_is_reached_and_the_e_stop_and_its_reset_are_confirmed(
    robot: str, up: Callable[..., psutil.Popen], watched: Callable[[str], Watched]
) -> None:
    arguments, goal = SYSTEMS[robot]
    up(*arguments)
    console = watched(robot)
    console.wait(console.runs)
    given = console.page.ask("goal", **goal)
    assert given.accepted, given.words
    seen: list[float] = []

    def reached() -> bool:
        seen.append(max(map(abs, console.sample.shares), default=0.0))
        return bool(console.health["goal"].get("at_goal"))

    console.wait(reached, FLIES_S)
    assert max(seen) > 0.0  # its actuators are shown at work
    assert "page 1" in console.health["goal"]["by"]
    stopped = console.page.ask("estop")
    assert stopped.accepted, stopped.words
    console.wait(lambda: not any(console.sample.shares), 2.0)
    refused = console.page.ask("goal", **goal)
    assert not refused.accepted
    assert "e-stop" in refused.words
    reset = console.page.ask("reset")
    assert reset.accepted, reset.words
    again = console.page.ask("goal", **goal)
    assert again.accepted, again.words
    kinds = [event["kind"] for event in console.source.events()]
    assert {"goal", "estop", "reset"} <= set(kinds)


def test_an_aircraft_takes_a_goal_of_the_page_and_is_stopped_only_as_far_as_it_can_be(
    up: Callable[..., psutil.Popen], watched: Callable[[str], Watched]
) -> None:
    up("mujoco_aircraft")
    console = watched("airship_v7")
    console.wait(console.runs)
    x, y, z, *_ = console.sample.pose
    given = console.page.ask("goal", targets=[[x, y, z + 1.0, 0.0, 0.0, 0.0, 1.0]])
    assert given.accepted, given.words
    console.wait(lambda: console.health.get("mode") == "active")
    stopped = console.page.ask("estop")
    assert stopped.accepted, stopped.words
    assert "flies level" in console.record["info"]["stops"]
    console.wait(lambda: console.health["commanded_by"] == "safe controller")


def test_a_plant_that_dies_is_noticed_and_one_that_begins_anew_is_shown_without_the_goal_before(
    up: Callable[..., psutil.Popen], watched: Callable[[str], Watched]
) -> None:
    first = up("mock_lqr")
    console = watched("floating_platform")
    console.wait(console.runs)
    assert console.page.ask("goal", targets=[[1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]]).accepted
    began, version = console.record["info"]["started_ns"], console.source.version()
    for child in first.children(recursive=True):
        child.kill()
    console.wait(lambda: console.sample.age_s > 1.0, 3.0)  # then the page greys it out
    console.wait(lambda: console.health["level"] == "silent", 8.0)
    assert "nothing has come from its plant" in console.health["words"]
    answered = console.page.ask("estop")
    assert not answered.accepted
    assert answered.words.startswith("NOT CONFIRMED")
    with contextlib.suppress(psutil.TimeoutExpired):
        first.wait(10.0)
    up("mock_lqr", "--start", "2,1,0")
    console.wait(lambda: console.record["info"]["started_ns"] != began)
    assert console.source.version() > version
    # The press holds: it was never confirmed, nor reset.
    console.wait(lambda: console.health["estop"])
    assert console.health.get("goal", {}).get("stamp_ns", "0") == "0"
    assert console.page.ask("reset").accepted
    console.wait(console.runs)
    assert console.sample.pose[0] == pytest.approx(2.0, abs=0.2)


def test_a_controller_is_chosen_by_its_name_and_a_wrong_name_is_refused(
    up: Callable[..., psutil.Popen], watched: Callable[[str], Watched]
) -> None:
    up("mock_lqr")
    console = watched("floating_platform")
    console.wait(console.runs)
    refused = console.page.ask("controller", controller="lqrr")
    assert not refused.accepted
    assert "lqr" in refused.words
    names = [each["name"] for each in console.record["info"]["controllers"]]
    law = next(name for name in names if name not in ("policy", "lqr", "teleoperation"))
    taken = console.page.ask("controller", controller=law)
    assert taken.accepted, taken.words
    console.wait(lambda: console.health["controller"]["name"] == law)
    assert console.health["last_command"]["by"] == "page 1"
    trained = console.page.ask("controller", controller="policy")
    assert not trained.accepted
    assert "Hz" in trained.words  # it was trained at another rate than this controller has


def test_a_simulation_is_paused_stepped_disturbed_and_goes_on(
    up: Callable[..., psutil.Popen], watched: Callable[[str], Watched]
) -> None:
    up("mock_lqr")
    console = watched("floating_platform")
    console.wait(console.runs)
    assert console.page.ask("pause", paused=True).accepted
    console.wait(lambda: console.health.get("paused") is True)
    before_s = console.health["sim_time_s"]
    console.wait(lambda: console.health["age_s"] < 1.5 and console.sample.age_s == 0.0)
    assert console.page.ask("step", steps=5).accepted
    refused = console.page.ask("step", steps=0)
    assert not refused.accepted
    assert console.page.ask("pause", paused=False).accepted
    console.wait(lambda: console.health.get("paused") is False and console.health["sim_time_s"] > before_s)
    pushed = console.page.ask("disturb", what={"what": "push"})
    assert pushed.accepted, pushed.words
    unknown = console.page.ask("disturb", what={"what": "pusch"})
    assert not unknown.accepted
    assert "push" in unknown.words
    words = " ".join(event["words"] for event in console.source.events() if event["kind"] == "disturb")
    assert "push" in words
    assert "page 1" in words


def test_two_robots_are_stopped_together_and_reset_together(
    up: Callable[..., psutil.Popen], watched: Callable[[str], Watched]
) -> None:
    up("mock_lqr", "--name", "alpha")
    up("mock_lqr", "--name", "beta", "--origin", "5,0,90")
    console = watched("alpha")
    other = Watched.__new__(Watched)
    other.source, other.robot = console.source, "beta"
    for each in (console, other):
        each.wait(each.runs)
    assert other.sample.pose[0] == pytest.approx(5.0, abs=0.1)
    everyone = Page(console.source.do, "*", "page 2")
    stopped = everyone.ask("estop")
    assert stopped.accepted, stopped.words
    for each in (console, other):
        assert each.health["stopped"]
        assert "page 2" in each.health["estop_by"]
    reset = everyone.ask("reset")
    assert reset.accepted, reset.words
    assert "alpha: " in reset.words
    assert "beta: " in reset.words


def test_a_plant_that_is_halted_is_never_called_stopped(
    up: Callable[..., psutil.Popen], watched: Callable[[str], Watched]
) -> None:
    system = up("mock_lqr")
    console = watched("floating_platform")
    console.wait(console.runs)
    plant = child_running(system, "sim_nodes.sim_node")
    plant.suspend()
    try:
        answered = console.page.ask("estop")
        assert not answered.accepted
        assert answered.after_s < 1.0
        assert not console.health["stopped"]
    finally:
        plant.resume()
    console.wait(lambda: console.health["stopped"], 5.0)  # pressed on, the plant obeys as soon as it can
