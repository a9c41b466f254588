"""What every family of actuators promises: commands, forces, mirror images, excitation and a safe controller."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.dynamics.batch_dynamics import PlanarDynamics, RollingDynamics, Steps
from fulmar_core.dynamics.by_kind import actuation_of
from fulmar_core.dynamics.linear_model import linearise, linearise_wrench
from fulmar_core.loop.teleop import Wish, hand_mapping
from fulmar_core.robots.actuators.families import FAMILIES, row_of
from fulmar_core.robots.actuators.fans import Fans
from fulmar_core.robots.actuators.pushing import PLANAR, Pushing
from fulmar_core.robots.actuators.refuge import slowdown
from fulmar_core.robots.actuators.rolling import Rolling
from fulmar_core.robots.topics import COMMAND, VELOCITY_COMMAND, command_wire
from fulmar_core.safety.actuator_guard import BRIDGED_S, ActuatorGuard
from fulmar_core.safety.watchdog import Watchdog
from fulmar_core.states.planar import PlanarState
from fulmar_evaluation.identification.model import nominal_world
from tests.new_robots import new_robot, robots_of_every_family
from tests.spaces import pushes_within_its_plane

ROBOTS = robots_of_every_family()
EACH = pytest.mark.parametrize("robot", ROBOTS.values(), ids=ROBOTS)
PUSHED = {name: robot for name, robot in ROBOTS.items() if isinstance(robot.actuators, Pushing)}
WHEELED = {name: robot for name, robot in ROBOTS.items() if isinstance(robot.actuators, Rolling)}
EACH_PUSHED = pytest.mark.parametrize("robot", PUSHED.values(), ids=PUSHED)
# Of bodies in space `fulmar_core/test_linear_model_in_space.py` tests the linear models.
IN_PLANE = {name: robot for name, robot in ROBOTS.items() if robot.state_type is PlanarState}
EACH_IN_PLANE = pytest.mark.parametrize("robot", IN_PLANE.values(), ids=IN_PLANE)
PUSHED_IN_PLANE = {name: robot for name, robot in PUSHED.items() if name in IN_PLANE}
EACH_PUSHED_IN_PLANE = pytest.mark.parametrize("robot", PUSHED_IN_PLANE.values(), ids=PUSHED_IN_PLANE)
DRIVEN = IN_PLANE | {name: robot for name, robot in PUSHED.items() if pushes_within_its_plane(robot)}
EACH_DRIVEN = pytest.mark.parametrize("robot", DRIVEN.values(), ids=DRIVEN)
EACH_WHEELED = pytest.mark.parametrize("robot", WHEELED.values(), ids=WHEELED)
SECOND_NS = 10**9
# Seconds after commands end, beyond the longest ramp of the robots here.
LATER_S = (0.0, 0.1, 0.5, 2.0, 20.0)


def test_every_family_is_under_this_contract_by_its_own_name():
    kinds = {robot.actuators.kind: type(robot.actuators) for robot in ROBOTS.values()}
    assert kinds == FAMILIES


def test_a_family_without_a_row_of_its_own_has_that_of_its_nearest_base():
    class Blowers(Fans):
        """No row is for these."""

    assert row_of({"pushing": 1, "fans": 2, "one_way": 3}, Blowers) == 2
    assert row_of({"pushing": 1, "one_way": 3}, Blowers) == 3
    assert row_of({"rolling": 4}, Blowers) is None


def some_commands(robot, count=40):
    """Commands between the ends of their ranges that the hardware can carry out."""
    actuators = robot.actuators
    rng = np.random.default_rng(4)
    shares = rng.random((count, len(actuators.scale)))
    return np.asarray(actuators.limited(actuators.lowest + shares * (actuators.scale - actuators.lowest)))


@EACH
def test_commands_lie_between_the_ends_of_their_ranges(robot):
    actuators = robot.actuators
    commands = np.asarray(actuators.limited(5.0 * some_commands(robot) - 2.0))
    assert (commands >= actuators.lowest - 1e-12).all()
    assert (commands <= actuators.scale + 1e-12).all()
    assert actuators.one_way == bool((actuators.lowest == 0.0).all())
    assert not actuators.binary or set(np.unique(commands)) <= {0.0, 1.0}


@EACH
def test_random_commands_are_what_the_hardware_can_do_and_use_every_actuator(robot):
    assert (robot.actuators.excitation is None) is robot.flies  # random commands crash an aircraft
    commands = robot.actuators.random_commands(np.random.default_rng(1), 200)
    np.testing.assert_allclose(robot.actuators.limited(commands), commands, rtol=0, atol=1e-12)
    assert (np.abs(commands).max(axis=0) > 0.5 * robot.actuators.scale).all()


@EACH_DRIVEN
def test_a_person_drives_it_ahead_and_round(robot):
    drive = hand_mapping(robot)
    assert drive(Wish()).tolist() == robot.actuators.safe_command.tolist()
    still = {"x": 0.0, "y": 0.0, "yaw": 0.0, "vx": 0.0, "vy": 0.0, "yaw_rate": 0.0}
    assert moved(robot, still, drive(Wish(ahead=1.0)), seconds=1.0).vx > 0.02
    # A car turns while it goes.
    turning = moved(robot, still, drive(Wish(ahead=0.5, turn=1.0)), seconds=1.0)
    assert turning.yaw_rate > 0.02


@pytest.mark.parametrize("name", ["int_ball2", "cubesat_8"])
def test_a_body_whose_actuators_push_out_of_its_plane_is_driven_by_all_of_them_within_it(name):
    robot = PUSHED[name]
    assert name not in DRIVEN
    drive = hand_mapping(robot)
    assert not drive(Wish()).any()
    for wish in (Wish(ahead=1.0), Wish(left=-1.0), Wish(turn=0.7), Wish(ahead=-0.5, turn=0.3)):
        force, torque = (part / most for part, most in zip(
            robot.actuators.wrench_in_body(drive(wish)),
            (robot.performance.force, robot.performance.torque), strict=True,
        ))  # fmt: skip
        np.testing.assert_allclose([force[2], *torque[:2]], 0.0, atol=1e-3)
        got, asked = np.array([force[0], force[1], torque[2]]), np.array(wish.parts)
        assert got @ asked > 0.9 * np.linalg.norm(got) * np.linalg.norm(asked)
        assert np.linalg.norm(got) > 0.4 * np.linalg.norm(asked)


def test_a_body_in_space_that_its_actuators_do_not_turn_about_every_axis_is_not_driven():
    for name in ("placeholder_ball", "cubesat_8_srb_layout"):
        with pytest.raises(ConfigError, match=r"its actuators push out of it\. Send it goals: fulmar goals"):
            hand_mapping(new_robot(name))


def test_a_satellite_is_not_driven_by_hand():
    for name in ("cubesat_wheels", "microsat", "smallsat"):
        with pytest.raises(ConfigError, match=r"robots with reaction_wheels are not driven by hand"):
            hand_mapping(ROBOTS[name])


MIRRORED = ("fan_disc", "jetbot", "kingfisher", "leatherback", "turtlebot2")


def test_robots_that_are_built_alike_on_both_sides_have_a_mirror_image():
    planar = {name: robot for name, robot in ROBOTS.items() if robot.state_type is PlanarState}
    assert {name for name, robot in planar.items() if robot.actuators.mirrored() is not None} == set(MIRRORED)


@pytest.mark.parametrize("robot", [ROBOTS[name] for name in MIRRORED], ids=MIRRORED)
def test_its_mirror_image_moves_as_its_mirror_image(robot):
    mirror = robot.actuators.mirrored()
    np.testing.assert_allclose(mirror @ mirror, np.eye(len(mirror)), atol=1e-12)
    still = {"x": 0.0, "y": 0.0, "yaw": 0.0, "vx": 0.0, "vy": 0.0, "yaw_rate": 0.0}
    for command in some_commands(robot, 5):
        one = moved(robot, still, command, seconds=0.4)
        other = moved(
            robot, still, command / robot.actuators.scale @ mirror * robot.actuators.scale, seconds=0.4
        )
        np.testing.assert_allclose([other.x, -other.y, -other.yaw], [one.x, one.y, one.yaw], atol=1e-9)


@EACH
def test_its_commands_come_in_on_the_wire_that_its_family_names(robot):
    assert command_wire(robot) is (VELOCITY_COMMAND if robot.actuators.takes_velocity else COMMAND)


@EACH_PUSHED
def test_the_planar_wrench_is_the_sum_of_what_each_actuator_pushes(robot):
    actuators, commands = robot.actuators, some_commands(robot)
    wrench = np.stack(actuators.planar_wrench(commands.T, np.ones_like(commands.T)), axis=-1)
    pushes = actuators.thrusts(commands)
    np.testing.assert_allclose(wrench, pushes @ actuators.wrench_per_newton[:, PLANAR], atol=1e-9)
    for push, row in zip(actuators.pushes, actuators.wrench_per_newton, strict=True):
        assert np.linalg.norm(push.direction) == pytest.approx(1.0)
        torque = np.cross(push.position, push.direction) + push.couple * np.array(push.direction)
        np.testing.assert_allclose(row, [*push.direction, *torque], atol=1e-9)
    np.testing.assert_allclose(
        actuators.full_thrust,
        [actuators.thrusts(row)[i] for i, row in enumerate(np.diag(actuators.scale))],
    )


class TestRefuge:
    """What is applied when commands end."""

    @EACH
    def test_it_is_within_limits_and_comes_to_the_safe_command_in_the_time_that_it_says(self, robot):
        actuators, refuge = robot.actuators, robot.actuators.refuge
        for last in some_commands(robot, 10):
            for since_s in LATER_S:
                command = refuge.command(since_s, last, None)
                np.testing.assert_allclose(actuators.limited(command), command, rtol=0, atol=1e-12)
            np.testing.assert_array_equal(
                refuge.command(refuge.longest_s, last, None), actuators.safe_command
            )

    @EACH
    def test_the_guard_applies_it_after_the_watchdog(self, robot):
        actuators = robot.actuators
        (last,) = some_commands(robot, 1)
        guard = ActuatorGuard(actuators, Watchdog(SECOND_NS))
        assert guard.offer(actuators.names, last.tolist(), 0)
        np.testing.assert_array_equal(guard.output(SECOND_NS), last)
        for since_s in LATER_S[1:]:
            applied = guard.output(SECOND_NS + round(since_s * SECOND_NS))
            np.testing.assert_array_equal(applied, actuators.refuge.command(since_s, last, None))

    @EACH_PUSHED
    def test_what_pushes_stops_at_once(self, robot):
        for last in some_commands(robot, 10):
            assert not robot.actuators.refuge.command(0.0, last, None).any()

    @EACH_WHEELED
    def test_wheels_slow_down_as_fast_as_they_may_and_never_turn_back(self, robot):
        actuators, period_s = robot.actuators, 0.05
        last = np.asarray(actuators.limited(actuators.scale))
        ramp = [last, *slowdown(actuators.refuge, last, actuators.safe_command, period_s)]
        assert len(ramp) > 1
        most = period_s * np.asarray(actuators.response.slew)
        assert (np.abs(np.diff(ramp, axis=0)) <= most + 1e-12).all()
        assert (np.array(ramp) * np.sign(last) >= 0.0).all()

    def test_a_family_that_steers_to_its_refuge_receives_the_state(self):
        """As a wing will: the guard passes what was measured on to it."""
        seen = []

        class Glide:
            longest_s = np.inf
            doing = "glides"

            def command(self, since_s, last, state):
                seen.append((since_s, state))
                return 0.5 * last

        actuators = ROBOTS["kingfisher"].actuators
        guard = ActuatorGuard(actuators, Watchdog(SECOND_NS), refuge=Glide())
        guard.offer(actuators.names, [0.4, 0.4], 0)
        assert guard.output(0).tolist() == [0.4, 0.4]
        measured = object()
        assert guard.output(3 * SECOND_NS, measured).tolist() == [0.2, 0.2]
        since_s, state = seen[-1]
        assert since_s == pytest.approx(3.0 - BRIDGED_S)  # it does not wait for the watchdog
        assert state is measured


def moved(robot, state, command, *, seconds):
    """State after a command was held, without disturbances; it counts as applied."""
    command = np.asarray(command, dtype=float)
    world = nominal_world(robot)
    actuation = actuation_of(robot, command[:, None])
    actuation.begin(command[:, None], world, None)
    in_plane = RollingDynamics if isinstance(robot.actuators, Rolling) else PlanarDynamics
    after = in_plane(robot).move(
        PlanarState(*(np.array([state[name]]) for name in PlanarState.COLUMNS)),
        actuation,
        world,
        (np.zeros(1),) * 3,
        Steps(round(seconds / robot.timing.physics_dt), off_centre=any(robot.body.center_of_mass)),
    )
    return after[0]


# Rolling ahead or drifting, turned, and not at an end of anything's range.
TRIM = {"x": 0.4, "y": -1.2, "yaw": 0.7, "vx": 0.0, "vy": 0.0, "yaw_rate": 0.05}


def trim_of(robot):
    """A state and a command that belong to it."""
    speed = 0.3 * robot.performance.speed
    state = TRIM | {"vx": speed * np.cos(TRIM["yaw"]), "vy": speed * np.sin(TRIM["yaw"])}
    actuators = robot.actuators
    if isinstance(actuators, Rolling):
        return state, np.array([speed, 0.05])
    share = (
        0.55 if not actuators.one_way else 0.08
    )  # beyond a propeller's dead band; below a shared line's limit
    return state, share * actuators.scale


def stacked(state):
    return np.array([float(getattr(state, name)) for name in PlanarState.COLUMNS])


@EACH_IN_PLANE
def test_the_linear_model_predicts_a_step_about_a_trim(robot):
    state, command = trim_of(robot)
    dt = robot.timing.control_s
    model = linearise(
        robot, PlanarState(*(np.asarray(state[name]) for name in PlanarState.COLUMNS)), command, dt
    )
    assert (model.a.shape, model.b.shape) == ((6, 6), (6, len(command)))
    rng, middle = np.random.default_rng(7), stacked(moved(robot, state, command, seconds=dt))
    small = 1e-3
    for _ in range(10):
        dx = small * rng.uniform(-1.0, 1.0, 6)
        du = small * rng.uniform(-1.0, 1.0, len(command)) * robot.actuators.scale
        other = {name: state[name] + step for name, step in zip(PlanarState.COLUMNS, dx, strict=True)}
        found = stacked(moved(robot, other, command + du, seconds=dt)) - middle
        predicted = model.a @ dx + model.b @ du
        assert np.abs(found).max() > 1e-5
        # What a linear model leaves out is of second order.
        np.testing.assert_allclose(predicted, found, rtol=0, atol=20.0 * small**2)


@EACH_PUSHED_IN_PLANE
def test_the_linear_model_of_a_wrench_is_that_of_the_commands_behind_it(robot):
    """Both go through the same dynamics, one with what the actuators make of commands."""
    state, command = trim_of(robot)
    dt, actuators = robot.timing.control_s, robot.actuators
    planar = PlanarState(*(np.asarray(state[name]) for name in PlanarState.COLUMNS))
    step = 1e-5 * np.eye(len(command))
    ones = np.ones_like(step)
    wrench = [
        float(part[0]) for part in actuators.planar_wrench(command[:, None], np.ones((len(command), 1)))
    ]
    either = [np.stack(actuators.planar_wrench(command[:, None] + sign * step, ones)) for sign in (1.0, -1.0)]
    per_command = (either[0] - either[1]) / 2e-5  # (3, n)
    by_wrench = linearise_wrench(robot, planar, np.array(wrench), dt)
    by_command = linearise(robot, planar, command, dt)
    np.testing.assert_allclose(by_wrench.a, by_command.a, atol=1e-6)
    np.testing.assert_allclose(by_wrench.b @ per_command, by_command.b, atol=1e-6)


@EACH_WHEELED
def test_wheels_take_no_wrench(robot):
    with pytest.raises(
        ConfigError, match=f"'{robot.name}' rolls on wheels, which take commands and no wrench"
    ):
        linearise_wrench(robot, PlanarState(*np.zeros(6)), np.zeros(3), robot.timing.control_s)


def test_at_the_end_of_its_range_a_fan_counts_with_what_it_can_still_do():
    robot = ROBOTS["fan_disc"]
    at_rest, closed = PlanarState(*np.zeros(6)), np.zeros(6)
    open_a_bit = linearise(robot, at_rest, closed + 0.01, robot.timing.control_s)
    np.testing.assert_allclose(
        linearise(robot, at_rest, closed, robot.timing.control_s).b, open_a_bit.b, rtol=1e-4, atol=1e-9
    )
