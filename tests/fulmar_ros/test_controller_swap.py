"""Another controller for a node that runs, and the fallback of one that was refused: by hand, without nodes."""

from __future__ import annotations

import json
import threading
from types import SimpleNamespace

import pytest

from fulmar_core.config.errors import BundleError
from fulmar_core.loop.controller_settings import ControllerSettings
from fulmar_core.loop.swap_request import LONGEST_PATH, SwapRequest
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task
from fulmar_ros import controller_swap
from fulmar_ros.controller_swap import ControllerSwap
from fulmar_ros.fallback import controllers_of

ROBOT, TASK = load_robot("floating_platform"), load_task("go_to_pose")


def loaded(request: SwapRequest) -> SimpleNamespace:
    return SimpleNamespace(what=request.what.upper(), sha256=f"sha of {request.what}")


class Operator:
    """Asks for controllers, and has what came of it."""

    def __init__(self, load=loaded) -> None:
        self.loaded, self.proposed, self.warnings, self.answers = [], [], [], []

        def load_and_note(request):
            self.loaded.append(request.what)
            return load(request)

        self.swap = ControllerSwap(
            load_and_note,
            lambda candidate: self.proposed.append(candidate.what),
            self.warnings.append,
            self.answers.append,
        )

    def ask(self, text: str) -> str:
        """Ask, and wait for the loader; what is said then."""
        self.swap.ask(text)
        self.wait()
        return self.swap.said

    def wait(self) -> None:
        if self.swap._loader is not None:
            self.swap._loader.join(10.0)


def asking(number: int | str, controller: str = "lqr") -> str:
    return json.dumps({"id": number, "controller": controller, "by": "alice"})


def refuse(*_):
    raise BundleError("its hash does not match")


def test_a_bundle_that_is_loaded_is_proposed_and_takes_over_once():
    operator = Operator()
    assert operator.ask("new") == "ready new"
    assert operator.proposed == ["NEW"]
    operator.swap.took_over(7)
    assert operator.swap.said == "done new"
    (answer,) = operator.answers
    assert (answer.id, answer.accepted, answer.bundle, answer.sha256, answer.stamp_ns) == (
        "", True, "new", "sha of new", 7,
    )  # fmt: skip


def test_a_law_by_its_name_is_answered_with_the_id_of_the_request():
    operator = Operator()
    assert operator.ask(asking("a-1")) == "ready lqr"
    assert operator.answers == []
    operator.swap.took_over(9)
    (answer,) = operator.answers
    assert (answer.id, answer.accepted, answer.controller, answer.by) == ("a-1", True, "lqr", "alice")
    assert answer.reason == "lqr controls"


@pytest.mark.parametrize("error", [BundleError("its hash does not match"), RuntimeError("no memory")])
def test_a_bundle_that_cannot_be_loaded_is_refused_and_changes_nothing(error):
    def load(_request):
        raise error

    operator = Operator(load)
    assert operator.ask("new").startswith("refused new: ")
    assert str(error) in operator.swap.said
    assert (operator.proposed, len(operator.warnings)) == ([], 1)
    assert [answer.accepted for answer in operator.answers] == [False]
    assert str(error) in operator.answers[0].reason


def test_while_one_controller_is_loaded_no_other_is():
    goes_on = threading.Event()

    def load(request):
        assert goes_on.wait(10.0)
        return loaded(request)

    operator = Operator(load)
    operator.swap.ask("slow")
    operator.swap.ask(asking(2))
    assert operator.swap.said == "refused lqr: another controller is being loaded"
    assert [(answer.id, answer.accepted) for answer in operator.answers] == [(2, False)]
    goes_on.set()
    operator.wait()
    assert (operator.loaded, operator.proposed) == (["slow"], ["SLOW"])


def test_of_two_operators_who_ask_for_the_same_controller_each_is_answered():
    goes_on = threading.Event()

    def load(request):
        assert goes_on.wait(10.0)
        return loaded(request)

    operator = Operator(load)
    operator.swap.ask(asking("alice"))
    operator.swap.ask(asking("bob"))
    goes_on.set()
    operator.wait()
    operator.swap.took_over(1)
    assert [(answer.id, answer.accepted) for answer in operator.answers] == [("bob", False), ("alice", True)]


@pytest.mark.parametrize("text", ["new", asking(1)])
def test_a_request_that_is_repeated_loads_once(text):
    operator = Operator()
    for _ in range(3):
        assert operator.ask(text).startswith("ready ")
    assert (len(operator.loaded), operator.swap.requests) == (1, 1)


def test_a_request_that_was_answered_gets_the_same_answer_and_loads_nothing():
    operator = Operator()
    operator.ask(asking(1))
    operator.swap.took_over(5)
    operator.ask(asking(1))
    assert operator.loaded == ["lqr"]
    assert len(operator.answers) == 2
    assert operator.answers[0] == operator.answers[1]


def test_a_controller_that_waits_for_a_control_step_is_reported_as_ready_and_then_as_done(monkeypatch):
    monkeypatch.setattr(controller_swap, "SOON_S", 0.0)
    operator = Operator()
    operator.ask(asking(1))
    for _ in range(3):
        operator.swap.look()
    operator.swap.took_over(3)
    assert [answer.stamp_ns for answer in operator.answers] == [0, 3]
    assert "next control step" in operator.answers[0].reason


def test_a_controller_that_another_one_overtakes_is_answered_with_a_refusal():
    operator = Operator()
    operator.ask(asking(1, "lqr"))
    operator.ask(asking(2, "mpc"))
    operator.swap.took_over(3)
    assert [(answer.id, answer.accepted) for answer in operator.answers] == [(1, False), (2, True)]


@pytest.mark.parametrize("folder", ["", "x" * (LONGEST_PATH + 1)])
def test_what_is_no_folder_is_refused_and_not_quoted_whole(folder):
    operator = Operator()
    assert "a folder has 1 to" in operator.ask(folder)
    assert operator.loaded == []
    assert len(operator.answers[0].bundle) <= LONGEST_PATH


def test_a_request_that_is_none_is_answered_by_its_id():
    operator = Operator()
    operator.ask(json.dumps({"id": 4, "controler": "lqr"}))
    (answer,) = operator.answers
    assert (answer.id, answer.accepted) == (4, False)
    assert "Did you mean 'controller'?" in answer.reason


def test_a_policy_that_is_refused_gives_its_place_to_the_fallback_and_says_why():
    complaints: list[str] = []
    settings = ControllerSettings(fallback="classical")
    switch = controllers_of(refuse, ROBOT, TASK, settings, complaints.append)
    assert switch.current.controller.name == "classical"
    assert switch.fell_back == "its hash does not match"
    assert complaints == ["falling back to classical: its hash does not match"]


def test_without_a_fallback_a_policy_that_is_refused_is_an_error():
    with pytest.raises(BundleError, match="its hash"):
        controllers_of(refuse, ROBOT, TASK, ControllerSettings(), pytest.fail)
