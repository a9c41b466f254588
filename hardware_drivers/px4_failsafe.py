"""Parameters of PX4's offboard failsafe, by MAVLink: px4_msgs carries none."""

from __future__ import annotations

import threading
import time

from fulmar_core.config.errors import DeviceError
from hardware_drivers.px4_settings import ACTIONS, BY_MAVLINK, Px4Failsafe

ANSWERS_S = 2.0  # for each parameter


def confirm_parameters(failsafe: Px4Failsafe, patience_s: float) -> None:
    """Set and read what PX4 does when the stream ends, where the file gives a MAVLink address.

    Raises:
        DeviceError: No PX4 answers there in time [s], or a parameter does not take its value.
    """
    if failsafe.confirm != BY_MAVLINK:
        return
    from hardware_drivers.mavlink_link import heartbeat, open_link, wait_for_autopilot
    from hardware_drivers.mavlink_parameters import Parameters, Wanted

    action = float(ACTIONS[failsafe.action])
    wanted = (
        Wanted(
            ("COM_OF_LOSS_T",), failsafe.loss_s, lambda value: 0.0 < value <= failsafe.loss_s + 1e-3,
            "seconds without the stream of offboard mode",
        ),
        Wanted(
            ("COM_OBL_RC_ACT",), action, lambda value: value == action, f"what PX4 does then: {failsafe.action}"
        ),
    )  # fmt: skip
    link, over = open_link(failsafe.mavlink, 115200, b"", patience_s), threading.Event()
    parameters: Parameters | None = None

    def receive() -> None:
        beaten_s = 0.0
        while not over.is_set():
            try:
                if time.monotonic() - beaten_s >= 1.0:
                    beaten_s = time.monotonic()
                    link.send(heartbeat())
                for message in link.receive():
                    if parameters is not None:
                        parameters.take(message)
            except OSError:
                return  # the questions go unanswered, and say so

    thread = threading.Thread(target=receive, name="PX4 parameters", daemon=True)
    thread.start()
    try:
        autopilot = wait_for_autopilot(link, failsafe.mavlink, patience_s)
        parameters = Parameters(link.send, autopilot, bytewise=True)
        problem = parameters.protect(wanted, ANSWERS_S)
    except OSError as error:
        problem = f"the link is gone ({error})"
    finally:
        over.set()
        thread.join(1.0)
        link.close()
    if problem:
        raise DeviceError(f"PX4 at {failsafe.mavlink}: {problem}. Nothing is armed.")
