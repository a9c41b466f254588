"""A run is led through its bag again under the guards that it had: time, area, e-stop, fallback, other policies."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fulmar_bags.contents import Bag, open_bag
from fulmar_bags.control_steps import ControlSteps, control_steps_of
from fulmar_bags.controller_changes import ControllerChange
from fulmar_bags.figures import describe
from fulmar_bags.gathered import Topic
from fulmar_bags.message_types import type_store
from fulmar_core.config.errors import BagError, RunFailed
from fulmar_core.controllers.classical import load_classical
from fulmar_core.controllers.controller import Inputs
from fulmar_core.controllers.rest import Rest
from fulmar_core.loop.swap_request import SwapResult
from fulmar_core.robots.topics import ESTOP, ESTOP_RELEASED, METADATA, SWAP, SWAP_RESULT, Wire
from fulmar_evaluation.rerun.live_node import rerun_through_node
from fulmar_evaluation.rerun.replay_controllers import answers_of
from fulmar_evaluation.rerun.rerun import Answers, rerun
from policy_server.controllers import Choice, load_controller, shipped_policy

BAGS = Path(__file__).resolve().parents[1] / "replay" / "bags"
BAG = BAGS / "floating_platform_go_to_pose_policy"
BUNDLE = str(shipped_policy("floating_platform", "go_to_pose"))
MS = 1_000_000


@pytest.fixture
def bag() -> Bag:
    return open_bag(BAG)


def guarded(bag: Bag, **guards: object) -> Bag:
    return replace(bag, info={**(bag.info or {}), "guards": guards})


def saying(bag: Bag, wire: Wire, *said: tuple[int, object]) -> Bag:
    """The bag with messages of a wire at these times of recording."""
    kind = type_store().types[wire.type]
    data = [bytes(type_store().serialize_cdr(kind(data=what), wire.type)) for _, what in said]
    name = f"/{bag.robot}/{wire.name}"
    logs = [log for log, _ in said]
    topic = Topic(name, wire.type, data, logs, logs, [0] * len(said))
    return replace(bag, topics={**bag.topics, name: topic})


def again(bag: Bag, *, follow: bool = False, paced: bool = False) -> tuple[ControlSteps, Answers]:
    record = control_steps_of(bag)
    if paced:
        record = at_its_pace(record)
    return record, answers_of(record, "policy", BUNDLE, "odometry", follow=follow)[0]


def at_its_pace(record: ControlSteps) -> ControlSteps:
    """Recorded as slowly as it went: 0.2 s a step, so that an e-stop has time to speak."""
    began = int(record.log_ns[0])
    goals = tuple(replace(goal, log_ns=began - MS) for goal in record.goals)
    return replace(record, log_ns=began + 200 * MS * np.arange(len(record)), goals=goals)


def test_max_run_time_ends_the_run_where_the_node_would(bag):
    _, answers = again(guarded(bag, max_run_time_s=10.0))
    assert answers.acted.tolist() == [True] * 51 + [False] * 49  # the step that reaches 10.2 s is the last
    assert "max_run_time of 10 s is over" in answers.reasons[51]
    assert not answers.commands[51:].any()


def test_a_ring_says_that_the_run_time_is_not_evaluated(bag):
    ring = guarded(bag, max_run_time_s=10.0)
    record = control_steps_of(replace(ring, info={**ring.info, "recording": {"mode": "ring"}}))
    assert record.settings.max_run_time_s == 0.0
    assert any("max_run_time" in warning for warning in record.warnings)


def test_a_robot_that_left_its_area_moves_no_more_without_a_new_goal_as_in_the_node(bag):
    record = control_steps_of(bag)
    x = record.odometry.pose[record.sample, 0]
    limit = 0.5 * float(record.goals[0].value[0, 0] + x.min())  # between the goal and the overshoot
    _, answers = again(guarded(bag, area=[limit, 1e6, -1e6, 1e6]))
    inside = x >= limit
    assert inside[np.argmin(inside) :].any()  # it would have come back
    np.testing.assert_array_equal(answers.acted, np.logical_and.accumulate(inside))
    assert any("outside its area" in reason for reason in answers.reasons)


def test_an_estop_stops_and_takes_the_goal_away(bag):
    record = at_its_pace(control_steps_of(bag))
    beats = range(int(record.log_ns[0]) - 50 * MS, int(record.log_ns[60]), 100 * MS)
    pressed = range(int(record.log_ns[20]) + 100 * MS, int(record.log_ns[30]))
    reported = saying(bag, ESTOP, *((log, log in pressed) for log in beats))
    record, answers = again(guarded(reported, estop=True), paced=True)
    assert answers.acted[:21].all()
    assert not answers.acted[21:].any()
    assert answers.reasons[25].startswith("e-stop: pressed")
    assert answers.reasons[50] == "no goal yet"
    assert "e-stop: silent" in answers.reasons[80]


def test_in_a_bag_that_lists_resets_only_a_reset_ends_a_press(bag):
    record = at_its_pace(control_steps_of(bag))
    beats = range(int(record.log_ns[0]) - 50 * MS, int(record.log_ns[-1]) + 50 * MS, 100 * MS)
    press = next(log for log in beats if log > record.log_ns[20])
    reported = saying(bag, ESTOP, *((log, log == press) for log in beats))
    for resets, reason in (((), "e-stop: pressed"), ((int(record.log_ns[40]),), "no goal yet")):
        listed = saying(reported, ESTOP_RELEASED, *((log, "") for log in resets))
        _, answers = again(guarded(listed, estop=True), paced=True)
        assert answers.acted[:20].all()
        assert answers.reasons[35].startswith("e-stop: pressed")
        assert answers.reasons[60].startswith(reason)


def test_while_a_press_is_on_its_way_the_record_decides(bag):
    record = at_its_pace(control_steps_of(bag))
    beats = range(int(record.log_ns[0]) - 30 * MS, int(record.log_ns[-1]) + 50 * MS, 100 * MS)
    at = int(record.log_ns[20])
    reported = saying(bag, ESTOP, *((log, log >= at - 30 * MS) for log in beats))
    record = at_its_pace(control_steps_of(reported))
    for acted in (True, False):
        recorded = record.acted.copy()
        recorded[20] = acted
        answers, _ = answers_of(replace(record, acted=recorded), "policy", BUNDLE, "odometry")
        assert answers.acted[20] == acted
        assert not answers.acted[21]


def test_an_estop_that_the_bag_lacks_is_a_reason_to_refuse(bag):
    with pytest.raises(BagError, match="e-stop, and the bag holds no message of it"):
        again(guarded(bag, estop=True))
    record = control_steps_of(guarded(bag, estop=True))
    with pytest.raises(BagError, match="--through direct"):
        rerun_through_node(bag, record, "policy", BUNDLE)


class Refused:
    """Says what no actuator can do, from some step on."""

    name, control_hz, estimator = "refused", 5.0, None
    readings, observer = (), None

    def __init__(self, record: ControlSteps, *, after: int, raises: bool = False) -> None:
        self._left, self._raises = after, raises
        self._shape = (1, len(record.robot.actuators.names))

    def reset(self) -> None:
        pass

    def act(self, inputs: Inputs) -> np.ndarray:
        self._left -= 1
        if self._left < 0 and self._raises:
            raise ValueError("no idea")
        return np.full(self._shape, np.nan if self._left < 0 else 0.0)


def test_three_refused_commands_let_the_fallback_take_over(bag):
    record = control_steps_of(bag)
    law = load_classical(record.robot, record.task, control_hz=5.0)
    answers = rerun(record, Refused(record, after=10), source="odometry", fallback=law)
    assert np.isnan(answers.actions[10:13]).all()
    assert np.isfinite(answers.actions[13:]).all()
    assert answers.acted.all()
    assert answers.commands[13:].any()


def test_without_a_fallback_three_refused_commands_are_a_fault(bag):
    record = control_steps_of(bag)
    answers = rerun(record, Refused(record, after=10), source="odometry")
    assert answers.acted.tolist() == [True] * 13 + [False] * 87
    assert "commands in a row were refused" in answers.reasons[13]


def test_a_fallback_takes_over_from_a_controller_that_raises(bag):
    record = control_steps_of(bag)
    law = load_classical(record.robot, record.task, control_hz=5.0)
    answers = rerun(record, Refused(record, after=10, raises=True), source="odometry", fallback=law)
    assert np.flatnonzero(~answers.acted).tolist() == [10]
    assert "raised ValueError at step 10" in answers.reasons[10]
    with pytest.raises(RunFailed, match="raised ValueError at step 10"):
        rerun(record, Refused(record, after=10, raises=True), source="odometry")


def test_a_policy_that_took_over_takes_over_again(bag):
    record = control_steps_of(bag)
    law = load_classical(record.robot, record.task, control_hz=5.0)
    at, sha256 = int(record.log_ns[40]), law.metadata()["sha256"]
    reported = saying(bag, SWAP, (at - 2, "lqr"))
    reported = saying(reported, METADATA, (at - 4, metadata(bag)), (at - 1, json.dumps({"sha256": sha256})))
    record = control_steps_of(reported)
    assert [change.value for change in record.changes] == [ControllerChange(sha256, bundle="lqr")]
    first = Refused(record, after=1000)
    answers = rerun(record, first, source="odometry", load=lambda change: law)
    assert not answers.actions[:40].any()
    assert answers.actions[40].any()


def test_a_policy_that_took_over_and_is_another_or_gone_is_refused(bag):
    at = int(control_steps_of(bag).log_ns[40])
    said = (at - 4, metadata(bag)), (at - 1, json.dumps({"sha256": "0" * 64}))
    reported = saying(bag, METADATA, *said)
    with pytest.raises(BagError, match="another one by now"):
        again(saying(reported, SWAP, (at - 2, BUNDLE)), follow=True)
    with pytest.raises(BagError, match="cannot be loaded"):
        again(saying(reported, SWAP, (at - 2, "/nowhere/policy")), follow=True)


def test_an_answer_says_from_which_measurement_on_a_controller_acts_whenever_it_was_recorded(bag):
    record = control_steps_of(bag)
    law = load_classical(record.robot, record.task, control_hz=5.0)
    at, sha256 = int(record.log_ns[50]), law.metadata()["sha256"]
    done = SwapResult(1, True, "lqr controls", "lqr", sha256=sha256, stamp_ns=int(record.stamp_ns[40]))
    refused = SwapResult(2, False, "unknown controller")
    ready = SwapResult(3, True, "ready", "mpc")
    answers = [(at - 3 + number, it.to_text()) for number, it in enumerate((done, refused, ready))]
    record = control_steps_of(saying(saying(bag, SWAP, (at - 9, "{}")), SWAP_RESULT, *answers))
    assert list(record.changes_by_step()) == [40]
    found = rerun(record, Refused(record, after=1000), source="odometry", load=lambda change: law)
    assert not found.actions[:40].any()
    assert found.actions[40].any()


@pytest.mark.parametrize("name", ["lqr", "mpc", "fallback", "teleoperation"])
def test_a_law_a_fallback_and_rest_that_took_over_take_over_again_and_give_way_to_the_policy(bag, name):
    record = control_steps_of(guarded(bag, fallback="lqr"))
    choice = Choice(5.0)
    loaded = (
        Rest(record.robot, control_hz=5.0, name=name)
        if name == "teleoperation"
        else load_controller("lqr" if name == "fallback" else name, record.robot, record.task, choice)
    )
    driven = load_controller("policy", record.robot, record.task, choice)
    sha256, policy = (each.metadata()["sha256"] for each in (loaded, driven))
    stamps = record.stamp_ns[[20, 60]].tolist()
    done = SwapResult(1, True, "", name, sha256=sha256, stamp_ns=stamps[0])
    back = SwapResult(2, True, "", "policy", sha256=policy, stamp_ns=stamps[1])
    log = record.log_ns.tolist()
    spoken = saying(
        guarded(bag, fallback="lqr"), SWAP_RESULT, (log[20], done.to_text()), (log[60], back.to_text())
    )
    alone, _ = again(spoken)
    followed, _ = answers_of(control_steps_of(spoken), "policy", BUNDLE, "odometry", follow=True)
    same = (alone.actions == followed.actions).all(axis=1)
    assert same[:20].all()
    assert not same[20:60].all()
    assert same[60:].all()


def metadata(bag: Bag) -> str:
    topic = bag.of(METADATA)
    return type_store().deserialize_cdr(topic.data[0], topic.type).data


def test_a_request_that_came_to_nothing_changes_nothing(bag):
    reported = saying(bag, SWAP, (bag.of(METADATA).log_ns[-1] + 1, "/nowhere/policy"))
    assert control_steps_of(reported).changes == ()


@pytest.mark.parametrize("guards", [{"max_run_time_s": "long"}, {"area": [0.0, 0.0, 2.0, 0.0]}])
def test_guards_without_sense_are_refused(bag, guards):
    with pytest.raises(BagError, match=r"invalid settings: [^\n]*$"):
        control_steps_of(guarded(bag, **guards))


@pytest.mark.parametrize("rate", ["fast", [1.0], {"hz": 1.0}])
def test_numbers_of_a_run_that_are_none_are_refused_in_one_line(rate, bag):
    assert replace(bag, info={"rate": 2}).number("rate", 1.0) == 2.0
    assert replace(bag, info={}).number("rate", 1.0) == 1.0
    with pytest.raises(BagError, match=r"^the run record of the bag has an invalid rate: [^\n]*$"):
        replace(bag, info={"rate": rate}).number("rate", 1.0)


def test_a_rate_that_is_no_number_is_refused_by_whoever_looks_at_the_bag(bag):
    damaged = replace(bag, info={**(bag.info or {}), "lockstep": False, "rate": "fast"})
    for look in (describe, control_steps_of):
        with pytest.raises(BagError, match="rate"):
            look(damaged)
