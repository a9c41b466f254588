"""Another policy for a controller that runs, and the fallback of one that was refused: by hand, without nodes."""

from __future__ import annotations

import threading

import pytest

from fulmar_core.config.errors import BundleError
from fulmar_core.loop.controller_settings import ControllerSettings
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task
from fulmar_ros.fallback import LONGEST_PATH, PolicySwap, controllers_of

ROBOT, TASK = load_robot("floating_platform"), load_task("go_to_pose")


class Operator:
    """Asks for policies, and has what came of it."""

    def __init__(self, load) -> None:
        self.loaded, self.proposed, self.warnings = [], [], []

        def load_and_note(folder):
            self.loaded.append(folder)
            return load(folder)

        self.swap = PolicySwap(load and load_and_note, self.proposed.append, self.warnings.append)

    def ask(self, folder: str) -> str:
        """Ask, and wait for the loader; what is said then."""
        self.swap.ask(folder)
        self.wait()
        return self.swap.said

    def wait(self) -> None:
        if self.swap._loader is not None:
            self.swap._loader.join(10.0)


def refuse(*_):
    raise BundleError("its hash does not match")


def test_a_bundle_that_is_loaded_is_proposed_and_takes_over_once():
    operator = Operator(str.upper)
    assert operator.ask("new") == "ready new"
    assert operator.proposed == ["NEW"]
    operator.swap.took_over()
    assert operator.swap.said == "done new"


@pytest.mark.parametrize("error", [BundleError("its hash does not match"), RuntimeError("no memory")])
def test_a_bundle_that_cannot_be_loaded_is_refused_and_changes_nothing(error):
    def load(_folder):
        raise error

    operator = Operator(load)
    assert operator.ask("new").startswith("refused new: ")
    assert str(error) in operator.swap.said
    assert (operator.proposed, len(operator.warnings)) == ([], 1)


def test_while_one_policy_is_loaded_no_other_is():
    goes_on = threading.Event()

    def load(folder):
        assert goes_on.wait(10.0)
        return folder

    operator = Operator(load)
    operator.swap.ask("slow")
    operator.swap.ask("quick")
    assert operator.swap.said == "refused quick: another policy is being loaded"
    goes_on.set()
    operator.wait()
    assert (operator.loaded, operator.proposed) == (["slow"], ["slow"])


def test_a_request_that_is_repeated_loads_once():
    operator = Operator(str)
    for _ in range(3):
        assert operator.ask("new") == "ready new"
    assert (operator.loaded, operator.swap.requests) == (["new"], 1)


def test_a_controller_that_runs_no_policy_refuses_one():
    operator = Operator(None)
    assert operator.ask("new") == "refused new: this controller runs no policy"
    assert operator.swap._loader is None


@pytest.mark.parametrize("folder", ["", "x" * (LONGEST_PATH + 1)])
def test_what_is_no_folder_is_refused_and_not_quoted_whole(folder):
    operator = Operator(str)
    assert "a folder has 1 to" in operator.ask(folder)
    assert operator.loaded == []


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
