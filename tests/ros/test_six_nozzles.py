"""A robot of one's own, with six nozzles on an emulated GPIO: a late bearing, a hand that holds it, a dead valve."""

from __future__ import annotations

import logging
import math
import sys
from pathlib import Path

import psutil
import pytest
import yaml

from fulmar_core.config.paths import OWN_FOLDERS, config_path
from tests.conftest import RosDomain
from tests.ros.cli import fulmar, json_of, run_in_real_time

pytestmark = [pytest.mark.slow, pytest.mark.real_time]
NAME, ARM_M = "hexfloat", 0.26


def nozzles() -> list[dict[str, object]]:
    """Two tangential nozzles on each of three arms."""
    found = []
    for arm in range(3):
        angle = math.radians(90.0 + 120.0 * arm)
        for side in (1.0, -1.0):
            found.append(
                {
                    "name": f"valve_{len(found) + 1}",
                    "position": [ARM_M * math.cos(angle), ARM_M * math.sin(angle), 0.0],
                    "direction": [-side * math.sin(angle), side * math.cos(angle), 0.0],
                }
            )
    return found


@pytest.fixture
def own(ros_domain: RosDomain, tmp_path: Path) -> dict[str, str]:
    """The environment with a folder of one's own: robot, hardware, gains and scenarios."""
    robot = yaml.safe_load(config_path("robots", "floating_platform").read_text(encoding="utf-8"))
    robot |= {"name": NAME, "title": "a platform with six nozzles"}
    robot["body"] |= {"mass": 7.2, "inertia": [0.25, 0.25, 0.28]}
    robot["uncertainty"] |= {"mass": [6.5, 8.0], "yaw_inertia": [0.2, 0.4]}
    robot["actuators"] |= {"thrust": 1.2, "nozzles": nozzles()}
    del robot["air_bearing"]  # the hardware file declares it
    hardware = {
        "title": "six valves on a GPIO chip",
        "robot": NAME,
        "driver": {
            "kind": "gpio_valves",
            "port": "/dev/gpiochip0",
            "lines": [f"V{number}" for number in range(6)],
            "order": [2, 0, 1, 5, 3, 4],
            "bearing": {"line": "AIR", "linger_s": 0.2},
        },
    }
    still = {"title": "of a test", "sensor_noise": True, "body": "nominal"}
    files = {
        f"robots/{NAME}": robot,
        f"hardware/{NAME}": hardware,
        # The valve of the bearing opens at the start, air carries the platform later: the driver does not know.
        "scenarios/late_and_held": still | {"bearing_late_s": [0.0, 3.0], "held_s": [3.0, 5.0]},
        "scenarios/dead": still | {"actuation": {"failures": 1, "failure_chance": 1.0}},
    }
    for name, content in files.items():
        path = tmp_path / "mine" / f"{name}.yaml"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(yaml.safe_dump(content), encoding="utf-8")
    gains = tmp_path / "mine" / "controllers" / f"{NAME}_lqr.yaml"
    gains.parent.mkdir()
    gains.write_text(config_path("controllers", "floating_platform_lqr").read_text(encoding="utf-8"))
    return ros_domain.env | {OWN_FOLDERS: str(tmp_path / "mine")}


@pytest.fixture
def busy() -> object:
    """Two other processes that take what they get."""
    others = [psutil.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(2)]
    yield
    for other in others:
        other.kill()
        other.wait()


def run(own: dict[str, str], tmp_path: Path, scenario: str, seed: int, duration_s: int) -> dict[str, object]:
    asked = (NAME, "--task", "go_to_pose", "--controller", "lqr", "--backend", "hardware", "--emulate")
    where = ("--start=0.6,-0.4,50", "--goal=0,0,0", "--duration", str(duration_s))
    done = run_in_real_time(
        *asked, *where, "--scenario", scenario, "--seed", str(seed), env=own, cwd=tmp_path
    )
    summary = json_of(done.stdout)
    assert summary["failure"] is None, done.stderr
    return summary


def test_with_air_that_comes_late_and_a_hand_that_holds_it_it_reaches_its_goal(
    seed_of_series: int, busy: object, own: dict[str, str], tmp_path: Path
) -> None:
    summary = run(own, tmp_path, "late_and_held", seed_of_series, 18)
    assert summary["success"], summary
    assert not summary["beliefs"]  # a hand may look like a dead valve for some seconds
    logging.info(f"{summary['final_position_error_m']:.3f} m, {summary['final_heading_error_deg']:.1f} deg")


def test_a_valve_that_is_really_dead_is_named_in_result_and_report(
    seed_of_series: int, busy: object, own: dict[str, str], tmp_path: Path
) -> None:
    summary = run(own, tmp_path, "dead", seed_of_series, 12)
    (dead,) = summary["believed_dead"]
    assert f"valve {dead} believed dead" in summary["beliefs"]
    done = fulmar("report", "bag", "--out", "report.html", env=own, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert f"valve {dead} believed dead" in (tmp_path / "report.html").read_text(encoding="utf-8")
    logging.info("goal met" if summary["success"] else "goal missed")
