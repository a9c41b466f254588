"""How the plants of a fleet stop: together, each whatever becomes of the others."""

from __future__ import annotations

import threading
from types import SimpleNamespace

import pytest

from fulmar_core.config.errors import DONE, FAILED
from sim_nodes.fleet_node import stop_together


def plants_that(*stops):
    return [SimpleNamespace(stop=stop) for stop in stops]


def test_no_plant_waits_for_another_to_stop_and_the_worst_exit_code_counts():
    all_there = threading.Barrier(4, timeout=5.0)

    def stop(code):
        all_there.wait()
        return code

    assert (
        stop_together(plants_that(*[lambda code=code: stop(code) for code in (DONE, FAILED, DONE, DONE)]))
        == FAILED
    )
    assert stop_together([]) == DONE


def test_a_plant_that_cannot_stop_leaves_no_other_moving():
    stopped = []

    def fail():
        raise OSError("the renderer is gone")

    with pytest.raises(OSError, match="the renderer"):
        stop_together(plants_that(fail, lambda: stopped.append("beta") or DONE))
    assert stopped == ["beta"]
