"""A plant's side of the e-stop: what is received goes to the guard at once, and then it is found out who pressed."""

from __future__ import annotations

import threading
import time

from rclpy.lifecycle import LifecycleNode
from std_msgs.msg import Bool, String

from fulmar_core.robots.topics import ESTOP, ESTOP_RELEASED, FLEET_ESTOP, OPERATOR_ACTION, Wire
from fulmar_core.safety.actuator_guard import ActuatorGuard
from fulmar_core.safety.estop_press import EstopPress
from fulmar_core.wires import operator_action
from fulmar_core.wires.operator_action import read_action
from fulmar_ros.operator_actions import publishers_of
from fulmar_ros.operator_subscription import destroy_all, subscribe_every
from fulmar_ros.relay import RelayedInputs

WIRES: tuple[Wire, ...] = (ESTOP, ESTOP_RELEASED, OPERATOR_ACTION)


def wires_of(*, fleet: bool) -> tuple[Wire, ...]:
    """What a plant subscribes; of a robot in a fleet, also the e-stop of all."""
    return (*WIRES, FLEET_ESTOP) if fleet else WIRES


class PlantEstop:
    """Subscribes the e-stop of a plant."""

    def __init__(
        self,
        node: LifecycleNode,
        guard: ActuatorGuard,
        lock: threading.Condition,
        relayed: RelayedInputs,
        *,
        fleet: bool = False,
    ) -> None:
        """Subscribe.

        Args:
            node: The plant.
            guard: Receives presses and releases; only touched under `lock`.
            lock: Guards it.
            relayed: Takes presses that only others received.
            fleet: Whether the e-stop of a fleet counts, too.
        """
        self._node, self._guard, self._lock = node, guard, lock
        self._press = EstopPress()
        # Its own presses the e-stop node claims; one that it does not is another's.
        self._button = f"{node.get_namespace().rstrip('/')}/estop"
        pressed = relayed.receiver(Bool, ESTOP, self._on_estop)
        self._subscriptions = [
            subscribe_every(node, Bool, ESTOP, pressed, with_info=True),
            subscribe_every(node, String, ESTOP_RELEASED, self._on_released),
            subscribe_every(node, String, OPERATOR_ACTION, self._on_action),
        ]
        if fleet:
            self._subscriptions.append(subscribe_every(node, Bool, FLEET_ESTOP, self._on_fleet_estop))

    @property
    def by(self) -> str:
        """Who pressed the e-stop; empty where it is not pressed, or where that is not known."""
        return self._press.by

    def held(self) -> bool:
        """Whether the e-stop holds the robot: pressed, silent, or required and not received."""
        with self._lock:
            return bool(self._guard.estop.reason(time.monotonic_ns()))

    def look(self) -> None:
        """Look for the name of who pressed, as long as discovery may still report it."""
        self._press.look(self._candidates, time.monotonic_ns())

    def destroy(self, node: LifecycleNode) -> None:
        """Destroy the subscriptions."""
        destroy_all(node, self._subscriptions)

    def _candidates(self) -> tuple[list[str], bool]:
        names, complete = publishers_of(self._node, (ESTOP.name,), but=(self._button,))
        return (names, complete) if names else publishers_of(self._node, (ESTOP.name,))

    def _on_estop(self, message: Bool, _info: dict[str, int]) -> None:
        now = time.monotonic_ns()
        with self._lock:
            self._guard.estop.receive(bool(message.data), now)
        if message.data and self._press.press(now):
            self.look()

    def _on_fleet_estop(self, message: Bool) -> None:
        if message.data:  # the reset is that of each robot
            self._on_estop(message, {})

    def _on_released(self, _message: String) -> None:
        with self._lock:
            self._guard.estop.release(time.monotonic_ns())
        self._press.release()

    def _on_action(self, message: String) -> None:
        action = read_action(message.data)
        if action is not None and action.does == operator_action.ESTOP:
            passes_on = action.by.startswith(f"{self._button} ")
            self._press.claim(action.by, time.monotonic_ns(), passes_on=passes_on)
