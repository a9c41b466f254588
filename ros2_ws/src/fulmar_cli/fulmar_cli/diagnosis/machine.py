"""Checks of the computer: clock, real-time limits, processor, timing, disk."""

from __future__ import annotations

import ctypes
import os
import resource
import shutil
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from fulmar_cli.diagnosis.check_result import Finding
from fulmar_core.config.process import PLANT_PRIORITY, RT_LIMIT

LATE_MS = 2.0  # what a 50 Hz loop may be late at the 99th percentile
FREE_BYTES = 1_000_000_000
WRITTEN_BYTES = 32_000_000
LEAST_MB_S = 20.0  # twice a camera of 640 x 480 at 10 Hz; a robot without one writes less than 1 MB/s
LOCKED_BYTES = 64_000_000  # of memory that never leaves the RAM: a node with its policy
CAN_LOCK, CAN_RAISE_PRIORITY = 14, 23  # bits of CAP_IPC_LOCK and CAP_SYS_NICE, capabilities(7)
UNSYNCHRONISED = 5  # TIME_ERROR of ntp_gettime(3)
GOVERNORS = Path("/sys/devices/system/cpu")


def kernel_clock() -> tuple[bool, float]:
    """Whether a daemon keeps the clock of the kernel synchronised, and its largest error [s]."""

    class Reading(ctypes.Structure):
        _fields_ = [(name, ctypes.c_long) for name in ("s", "us", "maxerror_us", "esterror_us")] + [
            ("rest", ctypes.c_long * 8)
        ]

    reading = Reading()
    state = ctypes.CDLL(None).ntp_gettime(ctypes.byref(reading))
    return state not in (-1, UNSYNCHRONISED), 1e-6 * reading.maxerror_us


def check_clock(read: Callable[[], tuple[bool, float]] = kernel_clock) -> Finding:
    """Whether the clock follows others: stamps of a motion capture or of a second computer are compared with it.

    Args:
        read: What the kernel says, as `kernel_clock`.
    """
    synchronised, error_s = read()
    if synchronised:
        return Finding("clock", "ok", f"synchronised, at most {1e3 * error_s:.1f} ms off")
    return Finding(
        "clock", "advice", "nothing synchronises it", "sudo timedatectl set-ntp true   # or: chrony"
    )


def check_real_time(
    rtprio: int | None = None, memlock: int | None = None, *, status: Path = Path("/proc/self/status")
) -> Finding:
    """Whether control threads may interrupt others, and keep their memory in the RAM.

    Args:
        rtprio: Limit of the real-time priority; that of this process by default.
        memlock: Limit of locked memory, -1 for none; that of this process by default [bytes].
        status: Where Linux lists the capabilities of the process, which count more than limits.
    """
    rtprio = resource.getrlimit(resource.RLIMIT_RTPRIO)[0] if rtprio is None else rtprio
    memlock = resource.getrlimit(resource.RLIMIT_MEMLOCK)[0] if memlock is None else memlock
    rights = _capabilities(status)
    lacking = []
    if 0 <= rtprio < PLANT_PRIORITY and not rights >> CAN_RAISE_PRIORITY & 1:
        lacking.append(f"rtprio is {rtprio}, less than {PLANT_PRIORITY}")
    if 0 <= memlock < LOCKED_BYTES and not rights >> CAN_LOCK & 1:
        lacking.append(f"memlock is {memlock / 1e6:.0f} MB, less than {LOCKED_BYTES / 1e6:.0f} MB")
    if not lacking:
        return Finding("real-time limits", "ok", "rtprio and memlock suffice")
    fix = (
        rf"printf '%s - rtprio {RT_LIMIT}\n%s - memlock unlimited\n' $USER $USER "
        "| sudo tee /etc/security/limits.d/fulmar.conf   # then log in again"
    )
    return Finding("real-time limits", "advice", "; ".join(lacking), fix)


def check_governor(folder: Path = GOVERNORS) -> Finding:
    """Whether the processor slows down where little is to do, and wakes late.

    Args:
        folder: Where Linux lists processors.
    """
    files = sorted(folder.glob("cpu[0-9]*/cpufreq/scaling_governor"))
    found = sorted({file.read_text().strip() for file in files})
    if found in ([], ["performance"]):
        return Finding("CPU governor", "ok", found[0] if found else "none: the frequency is fixed here")
    fix = "echo performance | sudo tee /sys/devices/system/cpu/cpu*/cpufreq/scaling_governor"
    return Finding("CPU governor", "advice", f"{', '.join(found)}: it wakes late", fix)


def check_timing(*, hardware: bool, most_ms: float = LATE_MS) -> Finding:
    """Whether a loop that sleeps wakes in time; too late is wrong only on a robot, since lock step does not mind.

    Args:
        hardware: Whether a robot is to be controlled.
        most_ms: How late it may wake at the 99th percentile [ms].
    """
    late = []
    for _ in range(100):
        due = time.monotonic() + 0.005
        time.sleep(max(0.0, due - time.monotonic()))
        late.append(1000.0 * (time.monotonic() - due))
    p99 = float(np.percentile(late, 99))
    found = f"a sleeping loop wakes {p99:.2f} ms late (p99)"
    if p99 < most_ms:
        return Finding("timing", "ok", found)
    return Finding(
        "timing", "wrong" if hardware else "advice", found, "top   # and end what takes the processor"
    )


def check_disk_space(folder: Path, *, least_bytes: int = FREE_BYTES) -> Finding:
    """Whether bags have room.

    Args:
        folder: Where they will be.
        least_bytes: What has to be free [bytes].
    """
    free = shutil.disk_usage(folder).free
    found = f"{free / 1e9:.1f} GB free here, bags need {least_bytes / 1e9:g} GB"
    if free >= least_bytes:
        return Finding("disk space", "ok", found)
    return Finding("disk space", "wrong", found, "du -sh runs/* | sort -h   # and remove runs")


def check_disk_speed(folder: Path, *, least_mb_s: float = LEAST_MB_S) -> Finding:
    """Write 32 MB and wait until the disk has them.

    Args:
        folder: Where bags will be.
        least_mb_s: Speed that suffices [MB/s].
    """
    try:
        with tempfile.TemporaryFile(dir=folder) as file:
            began = time.monotonic()
            file.write(bytes(WRITTEN_BYTES))
            file.flush()
            os.fsync(file.fileno())
            speed = WRITTEN_BYTES / 1e6 / (time.monotonic() - began)
    except OSError as error:
        fix = "cd ~   # or another folder that you may write"
        return Finding("disk speed", "wrong", f"{folder} cannot be written: {error.strerror}", fix)
    found = f"{speed:,.0f} MB/s in {folder}"
    if speed >= least_mb_s:
        return Finding("disk speed", "ok", found)
    fix = "fulmar run ROBOT --record /media/FAST_DISK/DIR   # record on a faster disk"
    return Finding("disk speed", "advice", f"{found}, less than {least_mb_s:g} MB/s", fix)


def _capabilities(status: Path) -> int:
    """Effective capabilities as bits; 0 where the system lists none."""
    try:
        lines = dict(line.split(":", 1) for line in status.read_text().splitlines())
        return int(lines["CapEff"], 16)
    except (OSError, KeyError, ValueError):
        return 0
