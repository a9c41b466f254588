"""The clock of one process steps; those of others, and waits in it, do not."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from fulmar_evaluation.faults.stepped_clock import SteppedClock, why_not

pytestmark = pytest.mark.skipif(bool(why_not()), reason=why_not() or "there is a compiler")

STEP_S = 10.0
# Prints the time of day, takes a line, prints it again, and then how long a wait with a deadline of that clock takes.
WATCH = """
import ctypes, sys, time
print(time.time(), flush=True)
sys.stdin.readline()
print(time.time(), flush=True)
libc = ctypes.CDLL(None)
class Spec(ctypes.Structure):
    _fields_ = [("s", ctypes.c_long), ("ns", ctypes.c_long)]
now, semaphore = Spec(), ctypes.create_string_buffer(64)
libc.sem_init(semaphore, 0, 0)
libc.clock_gettime(0, ctypes.byref(now))
now.s += 1
began = time.monotonic()
libc.sem_timedwait(semaphore, ctypes.byref(now))
print(time.monotonic() - began, flush=True)
"""


def watched(clock: SteppedClock, node: str) -> tuple[float, float]:
    """By how much the clock of a process stepped, and how long its wait of at most a second took [s]."""
    child = subprocess.Popen(
        [sys.executable, "-c", WATCH, f"__node:={node}"],
        env={**os.environ, **clock.environment},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert child.stdin is not None
    assert child.stdout is not None
    before = float(child.stdout.readline()) - time.time()
    clock.step(STEP_S)
    child.stdin.write("\n")
    child.stdin.flush()
    after = float(child.stdout.readline()) - time.time()
    waited_s = float(child.stdout.readline())
    child.wait(10.0)
    return after - before, waited_s


def test_the_clock_of_the_named_node_steps_and_its_waits_stay_as_long(tmp_path: Path):
    stepped_s, waited_s = watched(SteppedClock(tmp_path, "controller"), "controller")
    assert stepped_s == pytest.approx(STEP_S, abs=1.0)
    assert waited_s < 3.0


def test_the_clock_of_another_node_stays(tmp_path: Path):
    stepped_s, _ = watched(SteppedClock(tmp_path, "controller"), "plant")
    assert stepped_s == pytest.approx(0.0, abs=1.0)
