"""A cable between two hosts: whole, bad, cut; and nothing of the hosts stays behind."""

from __future__ import annotations

import os
import select
import socket
import time
from collections.abc import Iterator

import pytest

from fulmar_evaluation.faults.two_hosts import CUT, LOSSY, NETNS, Cable, Quality, inside, two_hosts, why_not

COUNT = 200
Ends = tuple[socket.socket, socket.socket]


@pytest.fixture
def ends() -> Iterator[tuple[Ends, Cable]]:
    """The outer ends of two devices, and the cable between their inner ends."""
    one, inner_one = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
    other, inner_other = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
    cable = Cable((inner_one.fileno(), inner_other.fileno()), seed=1)
    yield (one, other), cable
    cable.close()
    for end in (one, inner_one, other, inner_other):
        end.close()


def arrivals(sender: socket.socket, receiver: socket.socket) -> list[tuple[int, float]]:
    """Numbers of the frames that come through, and how late each is [s]."""
    found = []

    def receive(timeout_s: float) -> None:
        while select.select([receiver], [], [], timeout_s)[0]:
            number, sent = receiver.recv(100).split()
            found.append((int(number), time.monotonic() - float(sent)))
            timeout_s = min(timeout_s, 0.2)

    for number in range(COUNT):
        sender.send(f"{number} {time.monotonic()}".encode())
        receive(0.001)
    receive(0.2)
    return found


def test_a_whole_cable_carries_every_frame_in_order_both_ways(ends: tuple[Ends, Cable]) -> None:
    (one, other), _ = ends
    for way in ((one, other), (other, one)):
        assert [number for number, _ in arrivals(*way)] == list(range(COUNT))


def test_a_bad_cable_loses_a_tenth_and_delays_the_rest(ends: tuple[Ends, Cable]) -> None:
    (one, other), cable = ends
    cable.quality = LOSSY
    found = arrivals(one, other)
    assert 0.81 < len(found) / COUNT < 0.99  # four standard deviations
    late = sorted(late_s for _, late_s in found)
    assert late[0] >= 0.01
    assert 0.015 < late[len(late) // 2] < 0.03


def test_nothing_passes_a_cable_that_is_cut_and_it_can_be_mended(ends: tuple[Ends, Cable]) -> None:
    (one, other), cable = ends
    cable.quality = CUT
    assert not arrivals(one, other)
    cable.quality = Quality()
    assert len(arrivals(one, other)) == COUNT


@pytest.mark.skipif(bool(why_not()), reason=f"{why_not()}; the cable between them is tested above")
def test_two_hosts_reach_each_other_by_the_cable_alone_and_are_gone_afterwards_also_on_errors() -> None:
    class BrokenError(Exception):
        pass

    ours = os.readlink("/proc/thread-self/ns/net")
    with pytest.raises(BrokenError), two_hosts() as hosts:
        names = (hosts.robot, hosts.other)
        with inside(hosts.robot):
            assert os.readlink("/proc/thread-self/ns/net") != ours
            receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            receiver.bind(("10.77.0.1", 0))
            receiver.settimeout(0.5)
        with inside(hosts.other):
            sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        with receiver, sender:
            sender.sendto(b"whole", receiver.getsockname())
            assert receiver.recv(10) == b"whole"
            hosts.cable.quality = CUT
            sender.sendto(b"cut", receiver.getsockname())
            with pytest.raises(TimeoutError):
                receiver.recv(10)
        raise BrokenError
    assert os.readlink("/proc/thread-self/ns/net") == ours
    assert not any((NETNS / name).exists() for name in names)
