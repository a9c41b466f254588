"""Wires of which every message counts, for publishers and subscribers of every quality of service."""

from __future__ import annotations

import inspect
import threading
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy
from rclpy.subscription import Subscription

from fulmar_core.robots.topics import Wire
from fulmar_ros.qos import AT_ONCE, STREAM_DEPTH, subscriber_qos

# Asks rclpy for message info.
_WITH_INFO = inspect.signature(lambda message, info: None)
SETTLED_S = 0.1  # after the match of a publisher, until subscriptions are made for it
SUBSCRIPTIONS = 2  # of one latched wire, as its latched publishers count them
# Messages by which a second delivery is recognised; the middleware keeps no more for a reader
REMEMBERED = 5000


def subscribe_every(
    node: Node,
    kind: type,
    wire: Wire,
    callback: Callable[..., None],
    *,
    topic: str = "",
    depth: int | None = None,
    raw: bool = False,
    with_info: bool = False,
    lossless: bool = False,
) -> list[Subscription]:
    """Subscribe a wire to publishers of either reliability and durability; each message comes once.

    A publisher with default settings is volatile and never matches a transient-local subscription; a volatile
    subscription misses what a latched publisher sent before. A best-effort publisher matches no reliable subscription;
    a best-effort subscription does not get again what was lost. All of them together receive everything, and the second
    delivery of a message is dropped. The best-effort one is made with the first publisher that needs it; so is the
    latched one of a wire of the operator, since each that is there makes plain publishers warn of it.

    Args:
        node: Owner of the subscriptions.
        kind: Message class of the wire.
        wire: The wire.
        callback: Called with each message once, and, if asked for, with its info.
        topic: Name of the topic, where it is another than the wire's.
        depth: Messages that may wait for the callback; as in `subscriber_qos`. By default enough that the message of
            one publisher does not overwrite that of another.
        raw: Deliver serialized messages.
        with_info: Call back with the message info too.
        lossless: As in `subscriber_qos`.

    Returns:
        The subscriptions, for `destroy_all`; a later one joins the list.
    """
    depth = max(wire.latest, STREAM_DEPTH) if depth is None else depth
    receive = with_message_info(Once(callback, with_info=with_info).pass_on)
    made: list[Subscription] = []
    kinds: set[str] = set()
    lock = threading.Lock()

    def add(what: str, *, reliable: bool, latched: bool, events: SubscriptionEventCallbacks) -> None:
        qos = subscriber_qos(wire, reliable=reliable, depth=depth, latched=latched, lossless=lossless)
        name = topic or wire.name
        with lock:
            if what not in kinds:
                kinds.add(what)
                made.append(
                    node.create_subscription(kind, name, receive, qos, raw=raw, event_callbacks=events)
                )

    def add_best_effort() -> None:
        add("best effort", reliable=False, latched=False, events=SubscriptionEventCallbacks())

    def add_latched() -> None:
        # A volatile publisher does not match it, which is no fault.
        quiet = SubscriptionEventCallbacks(use_default_callbacks=False)
        add("latched", reliable=True, latched=True, events=quiet)

    def add_latched_if_offered() -> None:
        if "latched" not in kinds and _is_offered_latched(node, topic or wire.name):
            add_latched()

    on_demand = wire.delivery == "latched" and wire.source == "operator" and wire not in AT_ONCE
    events = SubscriptionEventCallbacks(
        incompatible_qos=_once_settled(node, add_best_effort),
        matched=_once_settled(node, add_latched_if_offered) if on_demand else None,
    )
    add("usual", reliable=True, latched=False, events=events)
    if wire.delivery == "latched" and not on_demand:
        add_latched()
    if wire in AT_ONCE:
        add_best_effort()
    return made


def _once_settled(node: Node, add: Callable[[], None]) -> Callable[[Any], None]:
    """A callback of an event that adds a subscription a moment later.

    Where a subscription is made while its executor serves the event of a match, and further matches arrive, the process
    crashes within seconds (EventsExecutor of rclpy 7.1.6, Fast DDS: a segmentation fault in whatever runs then).
    """

    def on_event(_event: Any) -> None:
        def add_once() -> None:
            node.destroy_timer(timer)
            add()

        timer = node.create_timer(SETTLED_S, add_once, clock=Clock(clock_type=ClockType.STEADY_TIME))

    return on_event


def _is_offered_latched(node: Node, topic: str) -> bool:
    """Whether the graph shows a publisher of a topic that keeps messages for subscribers to come."""
    infos = node.get_publishers_info_by_topic(node.resolve_topic_name(topic))
    return any(info.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL for info in infos)


def destroy_all(node: Node, subscriptions: Iterable[list[Subscription]]) -> None:
    """Destroy subscriptions that were made by `subscribe_every`."""
    for made in subscriptions:
        for subscription in made:
            node.destroy_subscription(subscription)


def with_message_info(callback: Callable[[Any, dict[str, int]], None]) -> Callable[..., None]:
    """A callback for `Node.create_subscription` that receives the message info from every executor.

    Args:
        callback: Called with each message and its info.
    """

    def on_message(*received: Any) -> None:
        # The EventsExecutor of rclpy 7.1 passes message and info as one tuple, other executors as two arguments.
        message, info = received if len(received) == 2 else received[0]
        callback(message, info)

    vars(on_message)["__signature__"] = _WITH_INFO
    return on_message


class Once:
    """A callback of several subscriptions that passes each message on once, by its source time and number."""

    def __init__(self, callback: Callable[..., None], *, with_info: bool) -> None:
        self._callback, self._with_info = callback, with_info
        self._order: deque[tuple[int, int]] = deque(maxlen=REMEMBERED)
        self._known: set[tuple[int, int]] = set()

    def pass_on(self, message: Any, info: dict[str, int]) -> None:
        """Call back, if this message did not come before."""
        if self._is_second(info["source_timestamp"], info["publication_sequence_number"]):
            return
        if self._with_info:
            self._callback(message, info)
        else:
            self._callback(message)

    def knows(self, info: dict[str, int]) -> bool:
        """Whether the message with this info came before."""
        return (info["source_timestamp"], info["publication_sequence_number"]) in self._known

    def _is_second(self, sent_ns: int, number: int) -> bool:
        """Whether this message came before; one without a source time is passed on each time."""
        key = (sent_ns, number)
        if not sent_ns or key in self._known:
            return bool(sent_ns)
        if len(self._order) == REMEMBERED:
            self._known.discard(self._order[0])
        self._order.append(key)
        self._known.add(key)
        return False


LOOK_S = 0.5  # a subscriber that was there at the look before is matched by now


class LateSubscribers:
    """Repeats latched messages for volatile subscribers that come late, which the middleware leaves out.

    Nodes that subscribe the topic latched, as ours do, need no repetition and cause none.
    """

    def __init__(self, node: Node, publisher: Publisher, current: Callable[[], Sequence[Any]]) -> None:
        """Look twice a second; `current` gives the messages as they were sent, so that nobody sees anything new."""
        self._node, self._publisher, self._current = node, publisher, current
        self._seen: set[bytes] = set()
        self._served: set[bytes] = set()
        node.create_timer(LOOK_S, self._look, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _look(self) -> None:
        seen = self._volatile()
        late = (seen & self._seen) - self._served
        self._served = (self._served | late) & seen
        self._seen = seen
        if late:
            for message in self._current():
                self._publisher.publish(message)

    def _volatile(self) -> set[bytes]:
        """Subscriptions of nodes that have no latched one, by their endpoints."""
        latched, volatile = set(), {}
        for info in self._node.get_subscriptions_info_by_topic(self._publisher.topic_name):
            subscriber = (info.node_namespace, info.node_name)
            if info.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL:
                latched.add(subscriber)
            else:
                volatile[bytes(info.endpoint_gid)] = subscriber
        return {endpoint for endpoint, subscriber in volatile.items() if subscriber not in latched}
