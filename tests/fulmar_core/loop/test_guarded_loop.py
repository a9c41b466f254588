"""The control loop behind its guards: what is received, and whether the controller may act on it."""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_core.estimators.actuator_health.applied import AppliedHistory
from fulmar_core.loop.controller_settings import ControllerSettings
from fulmar_core.loop.fallback import ControllerSwitch, Standby
from fulmar_core.loop.guarded_loop import ENDED, GuardedLoop, Refusal
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.arbiter import BEARING_OFF, Mode
from fulmar_core.safety.geofence import OUT_OF_BOUNDS
from fulmar_core.safety.input_gate import JUMP_M, Measurement
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal import goal_at
from tests.states import planar_state, received_targets

S, MS = 1_000_000_000, 1_000_000
ROBOT = load_robot("turtlebot2")
GENTLE = (0.01, 0.02)  # within the slew of one step from rest
LAB = (-1.0, 1.0, -1.0, 1.0)
GOAL, OTHER = goal_at((2.0, 0.0, 0.0)), goal_at((0.0, 2.0, 0.0))


class Scripted:
    """Answers with what it is given, and counts resets."""

    control_hz, estimator = ROBOT.timing.control_hz, None
    readings, observer = (), None

    def __init__(self, name, answer=GENTLE):
        self.name, self.answer, self.resets = name, answer, 0

    def reset(self):
        self.resets += 1

    def act(self, inputs):
        return np.tile(np.asarray(self.answer, dtype=float), (len(inputs.previous), 1))


class Estop:
    """An e-stop that holds where it has a reason."""

    def __init__(self):
        self.received, self.why = True, ""

    def reason(self, now_ns):
        return self.why


class Bench:
    """One guarded loop with a steady clock, and odometry in its rhythm."""

    def __init__(self, *, fallback=None, task="go_to_position", armed=True, applied=None, **settings):
        self.controller, self.estop = Scripted("first"), Estop()
        self.switch = ControllerSwitch(
            Standby(self.controller, "{}", ""), Standby(fallback, "{}", "") if fallback else None
        )
        self.guard = GuardedLoop(
            ROBOT,
            load_task(task),
            ControllerSettings(**settings),
            self.switch,
            self.estop,
            applied=applied,
        )
        self.now_ns = S
        if armed:
            self.guard.activate()

    def see(self, x=0.0, y=0.0, *, after_ns=100 * MS, frame="odom"):
        """Receive odometry; whether it was taken."""
        self.now_ns += after_ns
        noise = 1e-6 * (self.now_ns // MS % 7)  # that of a sensor, which never repeats itself
        self.seen = Measurement(self.now_ns, frame, "base_link", planar_state(x + noise, y, 0.0))
        return self.guard.take(self.seen, self.now_ns)

    def step(self, x=0.0, y=0.0, **how):
        """Receive odometry and do a control step: the decision, and the command."""
        self.see(x, y, **how)
        decision, inputs = self.guard.begin_step(self.guard.newest, self.now_ns)
        if inputs is None:
            return decision, None
        step = self.guard.act(inputs)
        self.guard.watch(inputs, step)
        self.guard.note(step.refusal)
        return decision, step.command[0].tolist()

    def give(self, goal=GOAL, stamp_ns=7):
        return self.guard.take_goal(received_targets(goal, self.guard.loop.task), stamp_ns, self.now_ns)


def test_it_acts_once_it_is_active_and_has_odometry_and_a_goal():
    bench = Bench(armed=False)
    assert bench.guard.decide(bench.now_ns).mode is Mode.IDLE
    bench.guard.activate()
    assert "no odom yet" in bench.guard.decide(bench.now_ns).reason
    assert bench.step()[0].reason == "no goal yet"
    assert bench.give() == ""
    decision, command = bench.step()
    assert (decision.mode, command) == (Mode.ACTIVE, list(GENTLE))
    assert bench.guard.acted == 1


def test_a_step_that_may_not_act_leaves_the_safe_command_as_the_previous_one():
    bench = Bench()
    bench.give()
    bench.step()
    assert bench.guard.loop.previous.any()
    bench.estop.why = "the button is pressed"
    decision, command = bench.step()
    assert (decision.reason, command) == ("the button is pressed", None)
    assert not bench.guard.loop.previous.any()
    assert bench.guard.loop.answered_ns == bench.seen.stamp_ns
    assert bench.guard.acted == 1


def test_odometry_that_is_refused_stops_the_controller_until_the_next_that_is_not():
    bench = Bench()
    bench.give()
    bench.step()
    assert not bench.see(frame="map")
    decision, inputs = bench.guard.begin_step(bench.guard.newest, bench.now_ns)
    assert inputs is None
    assert decision.reason == "odom is 'map' → 'base_link', must be 'odom' → 'base_link'"
    assert bench.step()[1] == list(GENTLE)


def test_an_input_of_two_nodes_stops_the_controller_which_begins_anew_when_one_is_gone():
    bench = Bench()
    bench.give()
    bench.step()
    before, words = bench.controller.resets, "2 nodes publish odom, and only one may: /a, /b"
    bench.guard.contest(words)
    decision, command = bench.step()
    assert (decision.mode, decision.reason, command) == (Mode.ARMED, words, None)
    bench.guard.contest("")
    assert bench.step(2.0 * JUMP_M)[1] == list(GENTLE)  # from wherever the one that is left says that it is
    assert bench.controller.resets == before + 1
    assert bench.guard.epoch == 0


def test_odometry_of_two_nodes_is_not_taken_at_all():
    bench = Bench()
    bench.give()
    bench.step()
    before = bench.guard.newest
    bench.guard.contest("2 nodes publish odom, and only one may: /a, /b")
    assert not bench.see(0.5)
    assert bench.guard.newest is before


def test_odometry_that_stays_away_stops_the_controller():
    bench = Bench()
    bench.give()
    bench.step()
    decision = bench.guard.decide(bench.now_ns + 10 * S)
    assert not decision.may_act
    assert "no usable odom for 10000 ms" in decision.reason


def test_activation_waits_for_fresh_odometry_and_counts_steps_anew():
    bench = Bench()
    bench.give()
    bench.step()
    bench.guard.activate()
    assert (bench.guard.newest, bench.guard.acted) == (None, 0)
    assert "no odom yet" in bench.guard.decide(bench.now_ns).reason
    assert bench.see(5.0 * JUMP_M)  # wherever it was carried meanwhile
    assert bench.guard.epoch == 0


def test_a_jump_of_the_odometry_lets_the_controller_forget_once():
    bench = Bench()
    bench.give()
    bench.step()
    before = bench.controller.resets
    assert not bench.see(2.0 * JUMP_M)
    assert bench.guard.epoch == 1
    for _ in range(3):
        bench.step(2.0 * JUMP_M)
    assert bench.controller.resets == before + 1


def test_a_new_goal_lets_the_controller_forget_and_a_repeated_one_does_not():
    bench = Bench()
    bench.give(GOAL, 7)
    bench.step()
    before = bench.controller.resets
    bench.give(GOAL, 7)
    bench.step()
    assert bench.controller.resets == before
    bench.give(OTHER, 8)
    bench.step()
    bench.step()
    assert bench.controller.resets == before + 1


def test_an_estop_takes_the_goal_away_and_its_repetition_starts_nothing():
    bench = Bench()
    bench.give(GOAL, 7)
    bench.step()
    bench.estop.why = "the button is pressed"
    bench.step()
    assert bench.guard.refusal.stamp_ns == 7
    bench.estop.why = ""
    assert bench.step()[0].reason == "no goal yet"
    assert bench.give(GOAL, 7) == f"{ENDED}. Publish it with a new stamp."
    assert bench.step()[0].reason == "no goal yet"
    assert bench.give(GOAL, 9) == ""
    assert bench.guard.refusal.reason == ""
    assert bench.step()[1] == list(GENTLE)


def test_a_goal_during_an_estop_is_refused_and_stays_void():
    bench = Bench()
    bench.estop.why = "the button is pressed"
    assert "Give a new goal once the e-stop is released" in bench.give(GOAL, 7)
    bench.estop.why = ""
    assert ENDED in bench.give(GOAL, 7)
    assert bench.step()[0].reason == "no goal yet"


def test_an_estop_that_was_never_received_keeps_the_goal():
    bench = Bench()
    bench.estop.received, bench.estop.why = False, "no e-stop yet"
    assert bench.give() == ""
    assert bench.step()[0].reason == "no e-stop yet"
    bench.estop.received, bench.estop.why = True, ""
    assert bench.step()[1] == list(GENTLE)


def test_a_robot_that_left_its_area_waits_for_a_new_goal_inside_it():
    bench = Bench(area=LAB)
    bench.give(goal_at((-1.0, 0.0, 0.0)), 7)
    bench.step(0.9)
    for x in (1.1, 0.9):
        decision, command = bench.step(x)
        assert command is None
        assert decision.reason
    bench.give(goal_at((-1.0, 1.0, 0.0)), 8)
    assert bench.step(0.9)[1] == list(GENTLE)


@pytest.mark.parametrize("place", [(1.1, 0.0, 0.0), (0.0, -2.0, 0.0)])
def test_a_goal_outside_the_area_is_refused_with_the_area_and_the_goal_before_it_stays(place):
    bench = Bench(area=LAB)
    inside = goal_at((-1.0, 0.0, 0.0))
    assert bench.give(inside, 7) == ""
    for _ in range(2):  # a repetition gets the same answer
        reason = bench.give(goal_at(place), 8)
        assert reason.startswith(OUT_OF_BOUNDS)
        assert "outside the area of x -1 to 1 m, y -1 to 1 m" in reason
    assert bench.guard.refusal.stamp_ns == 8
    assert bench.step()[1] == list(GENTLE)
    np.testing.assert_array_equal(bench.guard.loop.goal.current[0], inside.current)


def test_a_goal_of_an_invalid_message_is_reported_and_the_goal_before_it_stays():
    bench = Bench()
    bench.give(GOAL, 7)
    bench.guard.refuse_goal("goal quaternion has norm 2.000, must be 1", 8)
    assert (bench.guard.refusal.stamp_ns, bench.guard.refusal.reason[:15]) == (8, "goal quaternion")
    assert bench.step()[1] == list(GENTLE)
    np.testing.assert_array_equal(bench.guard.loop.goal.current[0], GOAL.current)
    bench.give(OTHER, 9)
    assert bench.guard.refusal.reason == ""


def test_a_goal_farther_than_a_kilometre_is_refused_without_an_area():
    assert "1,001 m from the origin, farther than 1,000 m" in Bench().give(goal_at((0.0, 1001.0, 0.0)))


def test_a_velocity_is_no_place_and_passes_any_area():
    bench = Bench(task="track_velocities", area=(5.0, 6.0, 5.0, 6.0))
    assert bench.give(goal_at((0.3, 0.0, 0.0))) == ""


def test_a_goal_beyond_the_geofence_is_not_driven_to():
    bench = Bench()
    bench.give(goal_at((ROBOT.limits.geofence + 1.0, 0.0, 0.0)))
    assert "beyond the geofence" in bench.step()[0].reason


def test_a_goal_beyond_the_geofence_is_reported_as_refused_with_its_first_distance():
    bench = Bench()
    bench.give()
    assert bench.step()[0].may_act
    bench.give(goal_at((ROBOT.limits.geofence + 1.0, 0.0, 0.0)), stamp_ns=8)
    reason = bench.step()[0].reason
    bench.step(x=-0.5)
    assert bench.guard.too_far == Refusal(8, reason)
    bench.give(stamp_ns=9)
    assert bench.step()[0].may_act and bench.guard.too_far == Refusal()


def test_a_robot_that_is_carried_away_from_a_goal_that_it_followed_refuses_nothing():
    bench = Bench()
    bench.give()
    assert bench.step()[0].may_act
    bench.step(x=-ROBOT.limits.geofence - 2.0)  # a jump, where a new epoch begins
    decision, _ = bench.step(x=-ROBOT.limits.geofence - 2.0)
    assert "beyond the geofence" in decision.reason and bench.guard.too_far == Refusal()


def test_an_air_bearing_has_to_be_known_to_be_on_and_once_on_again_the_past_is_forgotten():
    bench = Bench(air_bearing=True)
    bench.give()
    assert not bench.guard.bearing_known
    assert bench.step()[0].reason == BEARING_OFF
    bench.guard.take_bearing(True)
    assert bench.step()[1] == list(GENTLE)
    before = bench.controller.resets
    bench.guard.take_bearing(False)
    assert bench.step()[0].reason == BEARING_OFF
    bench.guard.take_bearing(True)
    bench.step()
    assert bench.controller.resets == before + 1
    assert Bench().guard.bearing_known  # a robot without one


def test_the_time_to_act_is_over_after_so_many_steps_of_the_controller_s_own():
    bench = Bench(max_run_time_s=0.3)
    bench.give()
    acted = [bench.step()[1] is not None for _ in range(6)]
    assert acted == [True, True, True, True, False, False]
    assert bench.guard.decide(bench.now_ns).reason == "max_run_time of 0.3 s is over"


def test_obstacles_and_block_are_waited_for_and_named():
    bench = Bench(task="go_to_position_with_obstacles")
    bench.give()
    assert bench.step()[0].reason == "no obstacles yet"
    bench.guard.take_obstacles(np.array([[1.0, 1.0, 0.1]]), 3)
    assert bench.step()[1] == list(GENTLE)
    np.testing.assert_array_equal(bench.guard.loop.goal.obstacles[0, 0, :3], [1.0, 1.0, 0.1])
    pusher = Bench(task="push_block")
    pusher.give()
    assert pusher.step()[0].reason == "no place of the block yet"
    pusher.guard.take_thing("block", np.array([1.0, 0.5, 0.0, 0.0, 0.0, 0.0, 1.0]), pusher.now_ns)
    assert pusher.step()[1] == list(GENTLE)
    np.testing.assert_array_equal(pusher.guard.loop.goal.things["block"], [[1.0, 0.5, 0.0]])


def test_refusals_in_a_row_latch_a_fault_where_there_is_no_fallback():
    bench = Bench()
    bench.give()
    bench.controller.answer = (np.nan, 0.0)
    assert [bench.step()[1] for _ in range(3)] == [[0.0, 0.0]] * 3
    decision, command = bench.step()
    assert (decision.mode, command) == (Mode.FAULT, None)
    assert "3 commands in a row were refused" in decision.reason


def test_refusals_in_a_row_are_the_fallback_s_turn():
    fallback = Scripted("fallback", (0.02, 0.01))
    bench = Bench(fallback=fallback)
    bench.give()
    bench.controller.answer = (np.nan, 0.0)
    for _ in range(3):
        bench.step()
    assert bench.guard.loop.controller is fallback
    assert bench.step()[1] == [0.02, 0.01]


def test_in_place_of_a_controller_that_raised_the_fallback_goes_on_if_there_is_one():
    fallback = Scripted("fallback")
    bench = Bench(fallback=fallback)
    assert bench.guard.fall_back("it raised")
    assert bench.guard.loop.controller is fallback
    assert not bench.guard.fall_back("it raised too")
    assert not Bench().guard.fall_back("it raised")


def test_a_proposed_controller_takes_over_between_two_steps_with_the_goal_as_far_along_as_it_is():
    bench, other = Bench(task="go_through_positions"), Scripted("other", (0.02, 0.01))
    bench.give(goal_at((0.0, 0.0, 0.0), (3.0, 0.0, 0.0)))
    for _ in range(2):
        bench.step()
    assert not bench.guard.switch_controller()
    bench.switch.propose(Standby(other, "{}", ""))
    assert bench.step()[1] == list(GENTLE)
    assert bench.guard.switch_controller()
    assert bench.step()[1] == [0.02, 0.01]
    assert bench.guard.mission.done == 1


def test_a_controller_of_a_record_observes_whatever_the_guards_say():
    bench = Bench()
    bench.give()
    bench.see()
    bench.guard.set(latched_fault="recorded")
    assert not bench.guard.decide(bench.now_ns).may_act
    inputs = bench.guard.observe(bench.seen)
    np.testing.assert_allclose(inputs.goal.current, [[2.0, 0.0, 0.0]])


@pytest.mark.parametrize("lockstep", [True, False])
def test_in_lock_step_episodes_may_begin_anywhere_with_a_goal(lockstep):
    bench = Bench(lockstep=lockstep)
    bench.give(GOAL, 7)
    bench.step()
    bench.give(goal_at((9.0, 0.0, 0.0)), 8)
    bench.now_ns -= 5 * S  # another episode begins earlier, elsewhere
    assert bench.see(9.0) is lockstep


def test_a_step_without_odometry_is_answered_by_the_safe_command():
    bench = Bench()
    decision, inputs = bench.guard.begin_step(None, bench.now_ns)
    assert not decision.may_act
    assert inputs is None
    assert bench.guard.loop.answered_ns == 0


FAST = (0.4, 0.0)  # a command with authority


def stand(bench, *, seconds=60.0):
    """Let a robot be commanded that does not move; the last decision."""
    for _ in range(round(seconds / 0.1)):
        decision, _ = bench.step()
        if not decision.may_act:
            break
    return decision


def test_a_robot_that_does_not_converge_stops_in_words_until_it_has_a_new_goal():
    bench = Bench()
    bench.controller.answer = FAST
    bench.give()
    decision = stand(bench)
    assert decision.mode is Mode.ARMED
    assert decision.reason.startswith("does not converge")
    assert bench.step()[0].reason == decision.reason
    assert not bench.guard.loop.previous.any()
    bench.give(OTHER, stamp_ns=bench.now_ns)
    assert bench.step()[0].mode is Mode.ACTIVE


def test_what_is_believed_dead_is_named_where_a_robot_does_not_converge():
    bench = Bench()
    bench.controller.answer = FAST
    bench.guard.suspect("valve thruster_3 believed dead")
    bench.give()
    assert "valve thruster_3 believed dead" in stand(bench).reason


@pytest.mark.parametrize(("task", "stops"), [("go_to_pose", True), ("go_to_position", False)])
def test_a_robot_that_can_hold_no_pose_without_what_is_dead_stops_in_a_task_of_poses(task, stops):
    bench = Bench(task=task)
    bench.controller.answer = FAST
    bench.guard.suspect("fan fan_3 believed dead", hopeless=True)
    bench.give()
    reasons = [bench.step()[0].reason for _ in range(3)]
    assert ("no pose can be held without it" in reasons[-1]) == stops


def test_a_goal_that_is_repeated_moves_no_robot_that_does_not_converge():
    bench = Bench()
    bench.controller.answer = FAST
    bench.give(stamp_ns=7)
    stand(bench)
    bench.give(stamp_ns=7)
    assert not bench.step()[0].may_act


def test_the_fallback_has_its_turn_before_a_robot_that_does_not_converge_stops():
    fallback = Scripted("fallback", FAST)
    bench = Bench(fallback=fallback)
    bench.controller.answer = FAST
    bench.give()
    for _ in range(600):
        bench.step()
        if bench.guard.switch.fell_back:
            break
    assert bench.guard.switch.fell_back.startswith("does not converge")
    assert bench.guard.loop.controller is fallback
    assert not stand(bench).may_act


def test_a_robot_that_another_one_drives_is_not_said_not_to_converge():
    history = AppliedHistory(S)
    bench = Bench(applied=history)
    bench.controller.answer = FAST
    bench.give()
    for _ in range(600):
        history.add(bench.now_ns, np.array([0.0, 0.9]))  # a person turns it
        assert bench.step()[0].may_act


def test_a_report_that_comes_before_its_step_is_seen_is_of_no_other():
    """The plant may report a command while the controller still looks at its step."""
    history = AppliedHistory(S)
    bench = Bench(applied=history)
    bench.give()
    act = bench.guard.act

    def act_and_report(inputs):
        step = act(inputs)
        history.add(bench.now_ns, step.command[0])
        return step

    bench.guard.act = act_and_report
    for number in range(600):
        bench.controller.answer = FAST[0] * (1.0 - 1e-3 * (number % 97)), FAST[1]
        if not bench.step()[0].may_act:
            return
    pytest.fail("it was taken for one that others drive")


def test_a_gentle_controller_is_not_said_not_to_converge():
    bench = Bench()
    bench.give()
    assert stand(bench).may_act
