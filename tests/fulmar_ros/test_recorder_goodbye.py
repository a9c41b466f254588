"""A recorder that is stopped closes its bag in time, also where others go on publishing."""

from __future__ import annotations

import itertools
import time
from types import SimpleNamespace

import pytest

from fulmar_bringup.recorder_row import WRITES_WITHIN_S
from fulmar_ros import recorder_node
from fulmar_ros.recorder_node import LONGEST_GOODBYE_S, RecorderNode


class Busy:
    """The thread of a bag that gets a message whenever it is asked how many there were."""

    def __init__(self):
        self._count, self.stopped_s = itertools.count(), None

    @property
    def received(self):
        return next(self._count)

    def stop(self):
        self.stopped_s = time.monotonic()
        raise InterruptedError("the end of this test")


def test_the_bag_is_closed_while_another_node_goes_on_publishing(monkeypatch):
    monkeypatch.setattr(recorder_node, "LONGEST_GOODBYE_S", 0.3)
    thread = Busy()
    node = SimpleNamespace(_provenance=SimpleNamespace(join=lambda _timeout: None), _thread=thread)
    began_s = time.monotonic()
    with pytest.raises(InterruptedError):
        RecorderNode.stop(node)
    assert 0.3 <= thread.stopped_s - began_s < 2.0


def test_who_stops_it_waits_for_longer_than_it_takes():
    assert LONGEST_GOODBYE_S + 1.0 < WRITES_WITHIN_S
