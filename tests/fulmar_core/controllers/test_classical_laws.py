"""What the classical laws do to their robots, in closed loop and step by step."""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import config_names, config_path
from fulmar_core.config.strict_yaml import load_config
from fulmar_core.controllers.by_kind import LAWS, laws_of
from fulmar_core.controllers.classical import check_pair, entry_of, has_law, load_classical
from fulmar_core.controllers.excite import Excite
from fulmar_core.controllers.guidance import way_to_face
from fulmar_core.loop.rollout import roll_out_in_batch
from fulmar_core.loop.teleop import hand_mapping
from fulmar_core.robots.actuators.family import Actuators
from fulmar_core.robots.actuators.response import Response
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.simulation.metrics import successes
from fulmar_core.states.planar import PlanarState
from fulmar_core.tasks import load_task
from fulmar_core.tasks.follow_reference import FlightStart
from fulmar_core.tasks.goal import goal_at
from fulmar_core.worlds.scenario import load_scenario
from tests.inputs import inputs_at
from tests.pairs import covering
from tests.spaces import task_for

ROBOTS = {name: load_robot(name) for name in config_names("robots")}
TASKS = {name: load_task(name) for name in config_names("tasks")}
PAIRS = [(robot, task) for robot in ROBOTS.values() for task in TASKS.values() if has_law(robot, task)]
WHEELED = [robot for robot in ROBOTS.values() if robot.actuators.kind in ("differential_drive", "ackermann")]
BOAT = ROBOTS["kingfisher"]


def at(x=0.0, y=0.0, yaw=0.0, vx=0.0, vy=0.0, yaw_rate=0.0):
    return PlanarState(*(np.asarray(float(value)) for value in (x, y, yaw, vx, vy, yaw_rate)))


def command(robot, task, state, *targets, previous=None):
    """What the law commands, in actuator units."""
    inputs = inputs_at(robot, task, state, goal_at(*targets), previous=previous)
    return load_classical(robot, task).act(inputs)[0]


# Each robot and each task once; an orbit lasts ten minutes, and flights a minute at 100 Hz each. Of episodes that take
# seconds of processor time the first part is tested below.
LONG = {
    ("cubesat_8", "inspect"),
    ("cubesat_8", "go_through_positions_3d"),
    ("int_ball2", "follow_pose_3d"),
    ("int_ball2", "go_to_pose_3d"),
}
QUICK = covering((r.name, t.name) for r, t in PAIRS if not (r.flies or r.actuators.turns_only)) - LONG


@pytest.mark.parametrize(
    ("robot", "task"),
    [
        pytest.param(
            robot,
            task,
            id=f"{robot.name}-{task.name}",
            marks=() if (robot.name, task.name) in QUICK else pytest.mark.slow,
        )
        for robot, task in PAIRS
    ],
)
def test_it_does_its_task_in_nine_of_ten_episodes(robot, task):
    law = load_classical(robot, task)
    run = roll_out_in_batch(law, robot, task, load_scenario("nominal"), episodes=64, seed=7)
    assert successes(run, task).mean() >= 0.9


@pytest.mark.parametrize(("robot", "task"), sorted(LONG))
def test_of_a_long_task_it_does_the_beginning(robot, task):
    """After twelve seconds no robot has left or hit anything, and each is nearer to its goal, or stays there."""
    robot, task = ROBOTS[robot], replace(TASKS[task], episode_s=12.0)
    run = roll_out_in_batch(
        load_classical(robot, task), robot, task, load_scenario("nominal"), episodes=8, seed=7
    )
    assert not (run.touching | run.outside).any()
    assert (run.position_error[:, -1] < np.maximum(run.position_error[:, 0], 0.05)).all()


@pytest.mark.parametrize("seconds", [1.0, pytest.param(8.0, marks=pytest.mark.slow)])
def test_an_aircraft_holds_its_height_and_its_side(seconds):
    start = FlightStart()  # on its height
    robot, task = ROBOTS["airship_v7"], replace(TASKS["fly_hold"], episode_s=seconds, start=start)
    run = roll_out_in_batch(
        load_classical(robot, task), robot, task, load_scenario("nominal"), episodes=8, seed=7
    )
    assert successes(run, task).all()


@pytest.mark.parametrize("robot", WHEELED, ids=lambda robot: robot.name)
def test_wheels_go_towards_goals_ahead_and_back_to_goals_behind(robot):
    task = TASKS["go_to_position"]
    assert command(robot, task, at(), (2.0, 0.0, 0.0))[0] > 0.0
    assert command(robot, task, at(), (-2.0, 0.0, 0.0))[0] < 0.0


@pytest.mark.parametrize("robot", [*WHEELED, BOAT], ids=lambda robot: robot.name)
@pytest.mark.parametrize("x", [2.0, -2.0])
def test_mirrored_goals_get_mirrored_commands(robot, x):
    task = TASKS["go_to_position"]
    left, right = (command(robot, task, at(), (x, y, 0.0)) for y in (0.5, -0.5))
    if robot is BOAT:
        np.testing.assert_allclose(left, right[::-1], atol=1e-9)
    else:
        np.testing.assert_allclose(left, right * [1.0, -1.0], atol=1e-9)
        assert left[1] > 0.0 if x > 0.0 or robot.actuators.kind == "ackermann" else left[1] < 0.0


@pytest.mark.parametrize("u", [0.3, -0.3])
def test_who_is_under_way_does_not_turn_back_for_a_goal_that_is_nearly_abeam(u):
    speed, abeam = np.asarray(u), (np.asarray(-0.2 * np.sign(u)), np.asarray(2.0))
    assert way_to_face(abeam, speed, backwards=True) == np.sign(u)
    assert way_to_face(abeam, np.asarray(0.0), backwards=True) == -np.sign(u)
    assert way_to_face((10.0 * abeam[0], abeam[1]), speed, backwards=True) == -np.sign(u)
    assert way_to_face((10.0 * abeam[0], abeam[1]), speed, backwards=False) == 1.0


@pytest.mark.parametrize("robot", [*WHEELED, BOAT], ids=lambda robot: robot.name)
def test_at_rest_at_the_goal_nothing_moves(robot):
    np.testing.assert_array_equal(
        command(robot, TASKS["go_to_position"], at(1.0, 2.0, 0.3), (1.0, 2.0, 0.0)), 0.0
    )


def test_a_base_at_its_place_turns_on_the_spot_to_its_heading():
    task = TASKS["go_to_pose"]
    for turn in (1.0, -1.0):
        speed, rate = command(ROBOTS["turtlebot2"], task, at(), (0.0, 0.0, turn))
        assert speed == 0.0
        assert np.sign(rate) == np.sign(turn)


def test_a_base_on_its_way_to_a_pose_is_driven_as_the_book_says():
    robot, task = ROBOTS["turtlebot2"], TASKS["go_to_pose"]
    gains = load_classical(robot, task).gains
    state, (x, y, yaw) = at(0.0, 0.0, 0.1), (0.2, 0.03, 0.25)
    rho, alpha = np.hypot(x, y), np.arctan2(y, x) - 0.1
    beta = yaw - 0.1 - alpha
    expected = gains.distance * rho, gains.bearing * alpha + gains.heading * beta
    assert command(robot, task, state, (x, y, yaw)) == pytest.approx(expected)


def test_a_car_drives_the_circle_through_a_goal_that_is_near():
    robot, task = ROBOTS["leatherback"], TASKS["go_to_position"]
    for x, y in ((0.4, 0.1), (0.3, -0.1), (-0.4, 0.1)):
        speed, steering = command(robot, task, at(), (x, y, 0.0))
        assert np.sign(speed) == np.sign(x)
        assert np.tan(steering) / robot.actuators.wheelbase == pytest.approx(2.0 * y / (x * x + y * y))


def test_a_car_drives_on_where_no_circle_leads_to_the_goal():
    robot, task = ROBOTS["leatherback"], TASKS["go_to_position"]
    for u in (0.3, -0.3):
        speed, steering = command(robot, task, at(vx=u), (0.0, 0.3, 0.0))
        assert np.sign(speed) == np.sign(u)
        assert steering == 0.0


def test_a_car_that_cannot_turn_so_slowly_drives_as_much_too_fast_as_it_turns_too_little():
    robot, task = ROBOTS["leatherback"], TASKS["track_velocities"]
    tightest = np.tan(robot.actuators.max_steering) / robot.actuators.wheelbase
    speed = load_classical(robot, task)._at_velocity(np.asarray(0.05), np.asarray(0.9), np.asarray(0.0))[0]
    speed /= 1.0 + load_classical(robot, task).gains.velocity  # at rest the feedback adds its share of it all
    too_fast = (speed - 0.05) / task.tolerance.velocity
    too_little = (0.9 - tightest * speed) / np.deg2rad(task.tolerance.yaw_rate_deg)
    assert too_fast == pytest.approx(too_little)


@pytest.mark.parametrize("name", ["turtlebot2", "jetbot"])
def test_a_base_at_the_wanted_velocity_is_commanded_to_keep_it(name):
    commanded = command(ROBOTS[name], TASKS["track_velocities"], at(vx=0.3, yaw_rate=-0.5), (0.3, 0.0, -0.5))
    assert commanded == pytest.approx([0.3, -0.5])


def test_a_boat_at_the_wanted_velocity_pushes_against_the_water_alone():
    u, r = 0.4, 0.2
    commanded = command(BOAT, TASKS["track_velocities"], at(vx=u, yaw_rate=r), (u, 0.0, r))
    ahead, _, moment = BOAT.actuators.planar_wrench(commanded, np.ones(2))
    drag, _, brake = BOAT.hydrodynamics.planar_damping(np.asarray(u), np.asarray(0.0), np.asarray(r))
    assert (ahead, moment) == pytest.approx((-drag, -brake))


def test_a_boat_goes_astern_to_a_pose_that_looks_away_from_it():
    task = TASKS["go_to_pose"]
    behind = (-3.0, 0.0)
    assert command(BOAT, task, at(), (*behind, 0.0)).sum() < 0.0
    turning = command(BOAT, task, at(), (*behind, np.pi))  # to go there ahead, it first has to turn
    assert abs(turning[0] - turning[1]) > 0.1


NUMBERS = [
    (robot, field.name)
    for robot in (ROBOTS["turtlebot2"], BOAT, ROBOTS["leatherback"])
    for field in fields(entry_of(robot, None).gains)
]


@pytest.mark.parametrize(("robot", "name"), NUMBERS, ids=lambda value: getattr(value, "name", value))
def test_the_metadata_hash_changes_with_every_gain(robot, name):
    entry = entry_of(robot, None)
    gains = load_config(entry.gains, config_path("controllers", f"{robot.name}_{entry.law.law}"))
    task, other = TASKS["go_to_position"], replace(gains, **{name: 1.01 * getattr(gains, name)})
    metadata = entry.law(robot, task, other).metadata()
    assert metadata["gains"] == asdict(other)
    assert metadata["sha256"] != entry.law(robot, task, gains).metadata()["sha256"]


@pytest.mark.parametrize("robot", ROBOTS.values(), ids=ROBOTS)
def test_a_rate_that_the_physics_cannot_keep_is_refused(robot):
    with pytest.raises(ConfigError, match=rf"'{robot.name}' at 7 Hz: control_hz = 7 must divide"):
        load_classical(robot, task_for(robot, "go_to_position"), control_hz=7.0)


def test_a_heading_gain_that_would_not_be_stable_is_refused():
    gains = load_classical(ROBOTS["turtlebot2"], TASKS["go_to_pose"]).gains
    with pytest.raises(ValueError, match=r"must be greater than 0 \(§3\.6\.2\)"):
        replace(gains, heading=-5.0)


def test_docs_state_of_every_law_and_of_every_task_that_one_does():
    text = (Path(__file__).parents[3] / "docs/controllers.md").read_text(encoding="utf-8")
    kinds = ("planar", "rolling", "free_flyer")
    entries = {law: entry for kind in kinds for laws in LAWS[kind].values() for law, entry in laws.items()}
    names = set(entries) | {entry.law.law for entry in entries.values()}
    tasks = {task for entry in entries.values() for task in entry.tasks if task != "track_velocities"}
    assert {name for name in names | tasks if f"`{name}`" not in text} == set()


def test_every_file_of_gains_belongs_to_a_robot_and_its_law():
    # Bodies in space do with default gains.
    in_plane = [robot for robot in ROBOTS.values() if robot.state_type is PlanarState]
    every = {f"{robot.name}_{entry_of(robot, None).law.law}" for robot in in_plane}
    others = {f"{robot.name}_{law}" for robot in in_plane for law in laws_of(robot)} - every
    found = set(config_names("controllers"))
    assert every <= found <= every | others
    assert {name.removeprefix("floating_platform_") for name in found & others} == {"mpc", "lqr_drift"}


@dataclass(frozen=True)
class Sails(Actuators):
    """A family that has nothing but what it must have."""

    kind: str = "sails"
    response: Response = Response()
    names = ("main",)
    scale = np.ones(1)

    def limited(self, command):
        return command


def test_a_family_without_a_law_or_an_excitation_is_named_in_one_line():
    robot, task = replace(load_robot("turtlebot2")), load_task("go_to_pose")
    object.__setattr__(robot, "actuators", Sails())
    assert not has_law(robot, task)
    with pytest.raises(
        ConfigError,
        match=r"no classical law is for 'turtlebot2' \(sails\); of robots on wheels there is one for: ",
    ):
        check_pair(robot, task)
    with pytest.raises(ValueError, match=r"'excite' drives thrusters, .*; 'turtlebot2' has sails"):
        Excite(robot, task)
    with pytest.raises(
        ConfigError, match="'turtlebot2' cannot be teleoperated: robots with sails are not driven"
    ):
        hand_mapping(robot)
