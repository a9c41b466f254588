"""When the loop of a simulated plant may take its next tick."""

from __future__ import annotations

import threading

from fulmar_ros.pace import Pace


def ticks(pace, most=100):
    """How many ticks a loop takes until it has to wait."""
    stop, taken = threading.Event(), 0
    while taken < most:
        threading.Timer(0.2, stop.set).start()
        pace.wait(stop)
        if stop.is_set():
            break
        taken += 1
    return taken


def test_a_step_of_a_simulation_that_runs_is_refused_and_not_kept():
    pace = Pace(ticks=10)
    assert not pace.step()
    pace.pause(True)
    assert ticks(pace) == 0


def test_a_step_of_a_paused_simulation_is_one_control_step():
    pace = Pace(ticks=10)
    pace.pause(True)
    assert pace.step()
    assert ticks(pace) == 10


def test_going_on_forgets_steps_that_were_not_taken():
    pace = Pace(ticks=10)
    pace.pause(True)
    pace.step()
    pace.pause(False)
    pace.pause(True)
    assert ticks(pace) == 0
