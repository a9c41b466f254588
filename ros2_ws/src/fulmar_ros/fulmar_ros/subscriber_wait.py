"""Waiting for readers: in lock step, where nothing may be overwritten that one has not got, and before the end."""

from __future__ import annotations

import time
from collections.abc import Iterable
from typing import Any

# What rclpy raises where the history is full has no public name.
from rclpy._rclpy_pybind11 import RCLError
from rclpy.duration import Duration
from rclpy.publisher import Publisher

from fulmar_core.errors import LockstepError

PATIENCE_S = 4.0  # less than a plant waits for an answer, so that whoever is held up says why
FLUSH_S = 2.0  # at the end of a run; a launcher that asked for the end waits 4 s
PAUSE_S = 0.002  # the middleware waits with the interpreter held; here others get it


def publish_patiently(publisher: Publisher, message: Any) -> None:
    """Publish, as soon as the readers have room.

    A reader that lags behind holds up lock step. One whose process has died counts until the run is ended for that,
    or until the middleware misses it.

    Args:
        publisher: With everything kept, see `publisher_qos`.
        message: Of its type.

    Raises:
        LockstepError: No room was made for 4 s.
    """
    until = time.monotonic() + PATIENCE_S
    while True:
        try:
            publisher.publish(message)
            return
        except RCLError as error:
            if time.monotonic() > until:
                raise LockstepError(
                    f"{publisher.topic_name}: a reader has taken nothing for {PATIENCE_S:g} s and holds up lock step. "
                    f"Does the recorder hang? ({str(error).splitlines()[0]})"
                ) from error
            time.sleep(PAUSE_S)


def flush(publishers: Iterable[Publisher], limit_s: float) -> None:
    """Wait until every reader has what was published, not for ever.

    Args:
        publishers: Reliable ones.
        limit_s: For all of them together [s].
    """
    until = time.monotonic() + limit_s
    for publisher in publishers:
        publisher.wait_for_all_acked(Duration(seconds=max(0.0, until - time.monotonic())))
