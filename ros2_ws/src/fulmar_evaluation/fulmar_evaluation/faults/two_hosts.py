"""Two network namespaces as two computers, and a cable between them that loses, delays or is cut.

The cable is a link of our own between two TAP devices: it asks nothing of the kernel but /dev/net/tun, where `tc netem`
needs a module that many kernels do not have, and each frame's fate follows from a seed.
"""

from __future__ import annotations

import contextlib
import ctypes
import fcntl
import heapq
import itertools
import os
import random
import select
import shutil
import struct
import subprocess
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from fulmar_core.config.errors import RunFailed
from fulmar_core.config.process import PLANT_PRIORITY, take_priority
from fulmar_ros.middleware import DISCOVERY_RANGE

TUN = Path("/dev/net/tun")
TUNSETIFF, IFF_TAP, IFF_NO_PI = 0x400454CA, 0x0002, 0x1000  # linux/if_tun.h
CLONE_NEWNET = 0x40000000  # linux/sched.h
NETNS = Path("/run/netns")  # where `ip netns` keeps them
FRAME = 65536
LOOK_S = 0.05  # how soon the cable notices that it shall end
ACROSS = {DISCOVERY_RANGE: "SUBNET"}  # what processes on them need in their environment
_numbers = itertools.count()


@dataclass(frozen=True)
class Quality:
    """What happens to each frame, in either direction."""

    loss: float = 0.0  # share that never arrives; 1: the cable is cut
    delay_s: float = 0.0  # [s]
    jitter_s: float = 0.0  # the delay is spread evenly by so much to both sides [s]


CUT = Quality(loss=1.0)
LOSSY = Quality(loss=0.1, delay_s=0.02, jitter_s=0.01)


class Cable:
    """Carries frames between two devices, in a thread of its own.

    Attributes:
        quality: Of the frames from now on.
    """

    def __init__(self, ends: tuple[int, int], *, seed: int) -> None:
        """Connect two open devices, whole."""
        self.quality = Quality()
        self._other = {ends[0]: ends[1], ends[1]: ends[0]}
        self._random = random.Random(seed)
        self._waiting: list[tuple[float, int, int, bytes]] = []  # due [s], number, to, frame
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run, name="cable", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Carry nothing any more."""
        self._over.set()
        self._thread.join()

    def _run(self) -> None:
        take_priority(PLANT_PRIORITY)
        number = itertools.count()
        while not self._over.is_set():
            ahead_s = self._waiting[0][0] - time.monotonic() if self._waiting else LOOK_S
            for end in select.select(list(self._other), [], [], min(max(ahead_s, 0.0), LOOK_S))[0]:
                with contextlib.suppress(BlockingIOError):
                    self._take(next(number), self._other[end], os.read(end, FRAME))
            while self._waiting and self._waiting[0][0] <= time.monotonic():
                _, _, to, frame = heapq.heappop(self._waiting)
                with contextlib.suppress(OSError):  # the device is not up, or its queue is full
                    os.write(to, frame)

    def _take(self, number: int, to: int, frame: bytes) -> None:
        quality = self.quality
        if self._random.random() >= quality.loss:
            late_s = quality.delay_s + quality.jitter_s * self._random.uniform(-1.0, 1.0)
            heapq.heappush(self._waiting, (time.monotonic() + late_s, number, to, frame))


@dataclass(frozen=True)
class TwoHosts:
    """Two namespaces, by name, and what is between them."""

    robot: str
    other: str
    cable: Cable


def why_not() -> str:
    """Why there cannot be two hosts here; empty if there can."""
    if os.geteuid() != 0:
        return "two hosts need root, for network namespaces"
    if shutil.which("ip") is None:
        return "two hosts need the command `ip` (package iproute2)"
    if not TUN.exists():
        return f"two hosts need {TUN} (kernel option TUN)"
    return ""


@contextlib.contextmanager
def two_hosts(*, seed: int = 0) -> Iterator[TwoHosts]:
    """Make two hosts; everything of them is gone afterwards, also on errors. Processes on them need `ACROSS`.

    Raises:
        RunFailed: They cannot be made; with what was said.
    """
    number = next(_numbers)
    names = [f"fulmar_{os.getpid()}_{number}_{side}" for side in ("robot", "other")]
    with contextlib.ExitStack() as undo:
        ends = []
        for place, name in enumerate(names, 1):
            _ip("netns", "add", name)
            undo.callback(_ip, "netns", "del", name)
            device = f"ful{os.getpid() % 1_000_000}{number}{place}"[-15:]
            end = _open_tap(device)
            undo.callback(os.close, end)
            ends.append(end)
            _ip("link", "set", device, "netns", name)
            _ip("-n", name, "addr", "add", f"10.77.0.{place}/24", "dev", device)
            _ip("-n", name, "link", "set", "lo", "up")
            _ip("-n", name, "link", "set", device, "up")
            _ip("-n", name, "route", "add", "224.0.0.0/4", "dev", device)
        cable = Cable((ends[0], ends[1]), seed=seed)
        undo.callback(cable.close)
        yield TwoHosts(names[0], names[1], cable)


@contextlib.contextmanager
def inside(host: str) -> Iterator[None]:
    """Let this thread, and the threads and processes that it starts, be on a host until the context ends."""
    with open("/proc/thread-self/ns/net") as ours, (NETNS / host).open() as theirs:
        _enter(theirs.fileno())
        try:
            yield
        finally:
            _enter(ours.fileno())


def _enter(namespace: int) -> None:
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.setns(namespace, CLONE_NEWNET) != 0:
        raise RunFailed(f"cannot enter a network namespace: {os.strerror(ctypes.get_errno())}")


def _open_tap(name: str) -> int:
    device = os.open(TUN, os.O_RDWR | os.O_NONBLOCK)
    try:
        fcntl.ioctl(device, TUNSETIFF, struct.pack("16sH22x", name.encode(), IFF_TAP | IFF_NO_PI))
    except OSError as error:
        os.close(device)
        raise RunFailed(f"{TUN}: cannot make a network device: {error.strerror}") from error
    return device


def _ip(*arguments: str) -> None:
    done = subprocess.run(["ip", *arguments], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RunFailed(f"`ip {' '.join(arguments)}` failed: {done.stderr.strip()}")
