"""A node reports a launcher that is stopped, and takes it back once the launcher goes on."""

from __future__ import annotations

import signal
import subprocess
import sys
import time

import pytest

from fulmar_core.config.process import LAUNCHER_PID, is_stopped
from fulmar_ros.launcher_watch import LOOK_S, STOPPED_S, WORDS, LauncherWatch


@pytest.fixture
def state(monkeypatch):
    """Whether the launcher is stopped now: `state[0]`."""
    monkeypatch.setenv(LAUNCHER_PID, "4711")
    return [False]


def said(watch: LauncherWatch, begin_s: float, end_s: float) -> list[str]:
    return [watch.problem(begin_s + 0.1 * n) for n in range(round((end_s - begin_s) / 0.1))]


def test_a_launcher_that_is_stopped_for_a_second_is_reported_until_it_goes_on(state):
    watch = LauncherWatch(stopped=lambda _pid: state[0])
    assert not any(said(watch, 100.0, 110.0))
    state[0] = True
    words = said(watch, 110.0, 115.0)
    assert words[0] == ""
    assert words[round((LOOK_S + STOPPED_S) / 0.1) + 1 :] == [WORDS] * (len(words) - 16)
    state[0] = False
    assert said(watch, 115.0, 120.0)[round(LOOK_S / 0.1) + 1 :] == [""] * 44


def test_a_launcher_that_pauses_for_a_moment_is_not_reported(state):
    watch = LauncherWatch(stopped=lambda _pid: state[0])
    for begin_s in range(100, 130):
        state[0] = begin_s % 2 == 0
        assert not any(said(watch, begin_s, begin_s + 0.9))


def test_a_node_that_a_person_started_has_no_launcher(monkeypatch):
    monkeypatch.delenv(LAUNCHER_PID, raising=False)
    watch = LauncherWatch(stopped=lambda _pid: True)
    assert not any(said(watch, 100.0, 110.0))


def test_a_process_is_stopped_between_sigstop_and_sigcont():
    process = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"])
    try:
        for number, expected in ((signal.SIGSTOP, True), (signal.SIGCONT, False)):
            process.send_signal(number)
            until = time.monotonic() + 5.0
            while is_stopped(process.pid) is not expected:
                assert time.monotonic() < until
                time.sleep(0.01)
    finally:
        process.kill()
        process.wait()
    assert not is_stopped(process.pid)
