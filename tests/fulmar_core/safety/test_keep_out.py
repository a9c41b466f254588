"""The guard of keep-out volumes: no controller flies a robot into one, and what is said of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.loop.control_loop import ControlLoop
from fulmar_core.loop.controller_settings import ControllerSettings
from fulmar_core.loop.fallback import ControllerSwitch, Standby
from fulmar_core.loop.guarded_loop import GuardedLoop
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.estop import EstopMonitor
from fulmar_core.safety.input_gate import Measurement
from fulmar_core.safety.keep_out import CLEAR_M, ENTERED, MARGIN_M, KeepOutGuard, drift_enters_s
from fulmar_core.simulation.simulation import BatchSimulation
from fulmar_core.states.attitude import even_directions
from fulmar_core.states.rotation import rotate_inverse
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import goal_in_float64
from fulmar_core.worlds.scenario import load_scenario
from fulmar_core.worlds.structures import list_structures, load_structure

ROBOTS = ("cubesat_8", "int_ball2", "spacecraft_16")
ROBOT, VOLUME = load_robot("int_ball2"), load_structure("gateway").keep_out
S = 1_000_000_000


class Malicious:
    """Pushes with all it has towards the middle of a thing, or, spinning, opens everything that turns the body."""

    name, estimator, observer, readings = "malicious", None, None, ()

    def __init__(self, robot, *, spins: bool) -> None:
        self.control_hz, self._robot = robot.timing.control_hz, robot
        self._push = (
            robot.actuators.wrench_per_newton[:, 3:] if spins else robot.actuators.wrench_per_newton[:, :3]
        )
        self._spins = spins

    def reset(self) -> None:
        """Nothing to forget."""

    def act(self, inputs):
        """Open what pushes towards the origin; a spinning one changes its mind every 20 s."""
        state = inputs.state
        place, quat = np.stack(state.position, axis=-1), np.stack(state.quat, axis=-1)
        wanted = rotate_inverse(quat, -place)
        turns = self._spins and (inputs.stamp_ns // 20_000_000_000) % 2 == 0
        along = (
            self._push @ np.ones(3) if turns else wanted @ self._robot.actuators.wrench_per_newton[:, :3].T
        )
        return (np.broadcast_to(along, (len(place), len(self._push))) > 0.0).astype(float)


def flown(
    name: str,
    thing: str,
    *,
    spins: bool,
    seconds: float,
    worlds: int = 8,
    first_m: float = 1.0,
    filled: float = 1.0,
):
    """Least distance of each robot from the volume, with a controller that flies straight at the thing.

    Its tank begins with a share of the full one's pressure.
    """
    robot, task = load_robot(name), load_task("go_to_pose_3d", thing)
    controller = Malicious(robot, spins=spins)
    scenario = load_scenario("nominal")
    supply = replace(scenario.actuation.supply, tank=filled)
    scenario = replace(scenario, actuation=replace(scenario.actuation, supply=supply))
    simulation = BatchSimulation(
        robot, task, scenario, worlds=worlds, seed=3, control_hz=controller.control_hz
    )
    volume = task.keep_outs[0]
    starts = (volume.radius + first_m) * even_directions(worlds)
    none = np.zeros(worlds)
    state = SpatialState.at_rest(tuple(starts.T), (none, none, none, none + 1.0))
    simulation.put(state, simulation.goal, simulation.command)
    loop = ControlLoop(robot, task, controller, robots=worlds)
    loop.begin(goal_in_float64(simulation.goal))
    least = np.full(worlds, np.inf)
    for step in range(round(seconds * controller.control_hz)):
        done = loop.step(simulation.measured, simulation.readings, round(1e9 * step * loop.dt))
        simulation.move(done.command)
        least = np.minimum(least, volume.distance(np.stack(simulation.truth.position, axis=-1)))
    return least


@pytest.mark.parametrize("spins", [False, True])
@pytest.mark.parametrize("name", ROBOTS)
def test_a_controller_that_flies_straight_at_a_thing_never_enters_its_volume(name: str, spins: bool) -> None:
    least = flown(name, "gateway", spins=spins, seconds=40.0 if spins else 25.0, worlds=4, first_m=0.6)
    assert (least > 0.0).all(), least
    assert spins or (least < 0.5).all(), "the guard lets the robot come near, and stops it there"


def moving(far: float, speed: float, aside: float = 0.0) -> SpatialState:
    """A robot so far from the Gateway's volume along x, that nears with some speed, and flies along y [m, m/s]."""
    x, zero, one = np.array([VOLUME.radius + far]), np.zeros(1), np.ones(1)
    return SpatialState(
        x, zero, zero, zero, zero, zero, one, -speed * one, aside * one, zero, zero, zero, zero
    )


def test_the_guard_holds_a_robot_that_could_not_stop_and_lets_it_go_once_it_has_left() -> None:
    guard = KeepOutGuard(ROBOT, [VOLUME], 0.2)
    assert not guard.holds(moving(3.0, 0.1))[0] and guard.words(moving(3.0, 0.1), ["gateway"]) == ""
    assert guard.holds(moving(0.3, 0.1))[0]
    words = "0.30 m from the keep-out volume of 'gateway', nears with 0.10 m/s: the guard brakes"
    assert guard.words(moving(0.3, 0.1), ["gateway"]) == words
    push, _ = ROBOT.actuators.wrench_in_body(guard.brake(moving(0.3, 0.1)))
    assert push[0, 0] > 0.0 and abs(push[0, 1:]).max() < 1e-3
    leaving = 0.5 * (MARGIN_M + CLEAR_M) + 0.05
    assert guard.holds(moving(leaving, -0.0))[0], "it acts on until the robot is clear"
    assert not guard.holds(moving(0.3, -0.05))[0]


def test_a_robot_in_the_volume_is_pushed_out_and_said_to_be_in_it() -> None:
    guard = KeepOutGuard(ROBOT, [VOLUME], 0.2)
    assert guard.holds(moving(-0.2, 0.0))[0]
    assert (
        guard.words(moving(-0.2, 0.0), ["gateway"])
        == f"0.20 m {ENTERED} of 'gateway': the guard pushes the robot out"
    )
    push, _ = ROBOT.actuators.wrench_in_body(guard.brake(moving(-0.2, 0.0)))
    assert push[0, 0] > 0.0


def test_a_drift_is_followed_for_a_minute_and_the_time_of_entry_said() -> None:
    place = np.array([[VOLUME.radius + 1.0, 0.0, 0.0]] * 4)
    velocity = np.array([[-0.1, 0.0, 0.0], [0.0, 0.2, 0.0], [0.1, 0.0, 0.0], [-0.01, 0.0, 0.0]])
    entry = drift_enters_s([VOLUME], place, velocity)
    assert entry[0] == pytest.approx(10.0, abs=0.3) and np.isnan(entry[1:]).all()


def guarded(state: SpatialState, goal: tuple[float, ...] | None) -> GuardedLoop:
    """A guarded loop beside the Gateway that has seen a robot, and was given a goal, where there is one."""
    controller = Malicious(ROBOT, spins=False)
    task = load_task("go_to_pose_3d", "gateway")
    switch = ControllerSwitch(Standby(controller, "{}", ""))
    guard = GuardedLoop(ROBOT, task, ControllerSettings(lockstep=True), switch, EstopMonitor(required=False))
    guard.activate()
    if goal is not None:
        guard.take_goal(np.array([goal]), 1, S)
    rigid = state[0].to_rigid()
    assert guard.take(Measurement(S, "odom", "base_link", rigid), S)
    return guard


FAR_GOAL = (9.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


def test_a_goal_within_the_volume_is_refused_in_one_line() -> None:
    guard = guarded(moving(3.0, 0.0), None)
    said = guard.take_goal(np.array([(0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)]), 1, S)
    assert "the goal x = 0.5 m, y = 0 m, z = 0 m lies 1.04 m within the keep-out volume of 'gateway'." in said
    assert guard.take_goal(np.array([FAR_GOAL]), 2, S) == ""


def test_the_guard_s_command_takes_the_place_of_the_controller_s_and_the_action_is_kept() -> None:
    near = moving(0.3, 0.1)
    guard = guarded(near, FAR_GOAL)
    decision, inputs = guard.begin_step(guard.newest, S)
    assert decision.may_act and inputs is not None
    step = guard.act(inputs)
    np.testing.assert_array_equal(step.action, guard.loop.controller.act(inputs))
    push, _ = ROBOT.actuators.wrench_in_body(step.command)
    assert push[0, 0] > 0.0, "away from the thing"
    assert "the guard brakes" in guard.held


def test_a_robot_without_a_goal_is_braked_where_its_drift_would_enter_and_left_alone_where_not() -> None:
    guard = guarded(moving(3.0, 0.1), None)  # far, yet there within a minute
    decision, inputs = guard.begin_step(guard.newest, S)
    assert decision.reason == "no goal yet" and inputs is None
    push, _ = ROBOT.actuators.wrench_in_body(guard.loop.previous)
    assert push[0, 0] > 0.0, "away from the thing"
    guard = guarded(moving(3.0, 0.0, aside=0.1), None)
    guard.begin_step(guard.newest, S)
    assert not guard.loop.previous.any(), "a drift that stays out needs no fuel"


def test_nothing_moves_a_robot_that_the_e_stop_holds_near_a_volume_either() -> None:
    guard = guarded(moving(0.3, 0.1), FAR_GOAL)
    guard._estop.receive(True, S)
    _, inputs = guard.begin_step(guard.newest, S)
    assert inputs is None and not guard.loop.previous.any()
    guard._estop.receive(False, S)
    guard.begin_step(guard.newest, S)
    assert not guard.loop.previous.any(), "after a reset nothing moves before a new goal"


@pytest.mark.slow
@pytest.mark.parametrize("spins", [False, True])
@pytest.mark.parametrize("thing", list_structures())
@pytest.mark.parametrize("name", ROBOTS)
def test_no_thing_is_entered_in_five_minutes_from_any_side(name: str, thing: str, spins: bool) -> None:
    least = flown(name, thing, spins=spins, seconds=300.0, worlds=32, first_m=3.0)
    assert (least > 0.0).all(), least
