"""Robots that have no gains file drive with gains from their own limits."""

from __future__ import annotations

from dataclasses import asdict, replace

import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import OWN_FOLDERS, config_names
from fulmar_core.controllers.classical import check_pair, entry_of, gains_of, has_law, load_classical
from fulmar_core.loop.rollout import roll_out_in_batch
from fulmar_core.robots.robot import Robot
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.metrics import successes
from fulmar_core.states.planar import PlanarState
from fulmar_core.tasks import load_task
from fulmar_core.worlds.scenario import load_scenario
from tests.new_robots import TASKS, write_new_robots

SHIPPED = {name: load_robot(name) for name in config_names("robots")}
PLATFORM, BASE, BOAT, CAR = (
    SHIPPED[name] for name in ("floating_platform", "turtlebot2", "kingfisher", "leatherback")
)


@pytest.fixture
def own(tmp_path, monkeypatch):
    """The new robots are known, and no gains of theirs."""
    write_new_robots(tmp_path / "mine")
    monkeypatch.setenv(OWN_FOLDERS, str(tmp_path / "mine"))


def without_file(robot: Robot, **changes) -> Robot:
    """The same robot under a name that no gains file has."""
    return replace(robot, name="other", **changes)


def success(robot: Robot, task_name: str, *, episodes: int) -> float:
    task = load_task(task_name)
    law = load_classical(robot, task)
    run = roll_out_in_batch(law, robot, task, load_scenario("nominal"), episodes=episodes, seed=7)
    return float(successes(run, task).mean())


@pytest.mark.parametrize("name", TASKS)
def test_a_new_robot_reaches_its_goals_without_a_gains_file(own, name):
    robot = load_robot(name)
    assert f"{name}_{entry_of(robot, None).law.law}" not in config_names("controllers")
    assert success(robot, TASKS[name], episodes=8) >= 0.95


# Bodies in space have no files of gains.
IN_PLANE = [name for name, robot in SHIPPED.items() if robot.state_type is PlanarState]
PAIRS = [
    (robot, task)
    for robot in IN_PLANE
    for task in map(load_task, config_names("tasks"))
    if has_law(SHIPPED[robot], task)
]


@pytest.mark.slow
@pytest.mark.timeout(300)
@pytest.mark.parametrize(("name", "task"), PAIRS, ids=[f"{name}-{task.name}" for name, task in PAIRS])
def test_default_gains_do_as_well_as_the_gains_of_the_shipped_robots(name, task):
    robot = SHIPPED[name]
    shipped = success(robot, task.name, episodes=256)
    default = success(without_file(robot), task.name, episodes=256)
    assert default >= shipped - 0.02


@pytest.mark.parametrize("robot", [PLATFORM, BASE, BOAT, CAR], ids=lambda robot: robot.actuators.kind)
def test_the_metadata_has_the_default_gains_in_four_digits(robot):
    law = load_classical(without_file(robot), load_task("go_to_position"))
    numbers = law.metadata()["gains"]
    assert numbers == asdict(gains_of(without_file(robot)))
    every = [*numbers.values(), *(numbers.get("observer") or {}).values()]
    assert all(value == float(f"{value:.4g}") for value in every if isinstance(value, float))


def test_a_gains_file_takes_the_place_of_default_gains():
    assert gains_of(BASE) != gains_of(without_file(BASE))


@pytest.mark.parametrize("law", ["mpc", "lqr_drift"])
def test_laws_without_default_gains_ask_for_a_file(law):
    words = rf"no gains of '{law}' for 'other'. Write configs/controllers/other_{law}\.yaml"
    with pytest.raises(ConfigError, match=words):
        check_pair(without_file(PLATFORM), load_task("go_to_pose"), law=law)


def test_a_heavier_platform_brakes_earlier():
    heavier = without_file(PLATFORM, body=replace(PLATFORM.body, mass=4.0 * PLATFORM.body.mass))
    assert gains_of(heavier).velocity == pytest.approx(
        4.0 * gains_of(without_file(PLATFORM)).velocity, rel=1e-3
    )


def test_the_observer_expects_errors_in_proportion_to_the_thrust():
    strong = without_file(PLATFORM, actuators=replace(PLATFORM.actuators, thrust=10.0))
    usual, scaled = gains_of(without_file(PLATFORM)).observer, gains_of(strong).observer
    assert usual.model_force == pytest.approx(0.087)  # of `HealthSettings`, which was chosen on this platform
    assert (scaled.model_force, scaled.push_torque) == pytest.approx(
        (10.0 * usual.model_force, 10.0 * usual.push_torque), rel=1e-3
    )


def test_a_robot_without_a_health_estimate_has_no_observer():
    assert (
        gains_of(without_file(PLATFORM, hydrodynamics=BOAT.hydrodynamics, air_bearing=False)).observer is None
    )


def test_slow_actuators_make_slow_laws():
    slow_wheels = replace(BASE.actuators, response=replace(BASE.actuators.response, lag_s=0.5))
    weak_wheels = replace(BASE.actuators, wheel_force=0.4)
    slow_car = replace(CAR.actuators, response=replace(CAR.actuators.response, lag_s=0.5))
    slow_boat = replace(BOAT.actuators, response=replace(BOAT.actuators.response, slew=(0.2, 0.2)))
    assert gains_of(without_file(BASE, actuators=slow_wheels)).bearing < gains_of(without_file(BASE)).bearing
    assert (
        gains_of(without_file(BASE, actuators=weak_wheels)).distance < gains_of(without_file(BASE)).distance
    )
    assert gains_of(without_file(CAR, actuators=slow_car)).approach < gains_of(without_file(CAR)).approach
    assert gains_of(without_file(BOAT, actuators=slow_boat)).heading < gains_of(without_file(BOAT)).heading


def test_a_boat_cruises_at_a_share_of_the_speed_at_which_drag_equals_thrust():
    # 39 N ahead against 17.26 N/(m/s)²: configs/robots/kingfisher.yaml.
    assert gains_of(without_file(BOAT)).cruise == pytest.approx(0.6 * (39.0 / 17.2576) ** 0.5, rel=0.01)


IN_LINE = tuple(replace(each, position=(each.position[0], 0.0, 0.0)) for each in BOAT.actuators.propellers)


@pytest.mark.parametrize(
    ("robot", "changes", "words"),
    [
        (PLATFORM, {"nozzles": PLATFORM.actuators.nozzles[:3]}, "thrusters do not push in every direction"),
        (BOAT, {"propellers": IN_LINE}, "propellers are not side by side"),
    ],
    ids=["platform", "boat"],
)
def test_a_robot_whose_actuators_do_not_steer_it_is_refused_before_anything_starts(robot, changes, words):
    lame = without_file(robot, actuators=replace(robot.actuators, **changes))
    with pytest.raises(ConfigError, match=rf"no default gains of '\w+' for 'other': the {words}"):
        check_pair(lame, load_task("go_to_position"))
