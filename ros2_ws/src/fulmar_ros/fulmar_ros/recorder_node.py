"""The recorder: every recorded wire of one robot into one bag."""

from __future__ import annotations

import contextlib
import sys
import threading
import time
from collections.abc import Callable, Iterable
from dataclasses import asdict
from pathlib import Path

from rclpy.node import Node
from rclpy.subscription import Subscription

from fulmar_bags.contents import recorded_faults
from fulmar_bags.frame_messages import COMPRESSED, IMAGE
from fulmar_bags.frame_recording import PackedFrames
from fulmar_bags.frame_topics import PACKED_ENDINGS
from fulmar_bags.gathered import json_object
from fulmar_bags.interrupted_bag import interrupted_bag
from fulmar_bags.mcap_records import custom_text
from fulmar_bags.per_goal import BagPerGoal
from fulmar_bags.ring import FAULTS, BagRing, fault_finder
from fulmar_bags.writer import BagWriter, check_free
from fulmar_bags.writer_thread import RECORDING, BagThread
from fulmar_core.config.errors import DONE, FAILED, BagError
from fulmar_core.config.provenance import attachments
from fulmar_core.robots.topics import (
    ACTUATORS_STATE,
    AIR_BEARING,
    CAMERA_COMPRESSED,
    CAMERA_IMAGES,
    CAMERA_INFO,
    COMMAND,
    GOAL_POSES,
    GOAL_WIRES,
    MOCAP,
    ODOMETRY,
    PERIOD,
    SENSOR_WIRES,
    VELOCITY_COMMAND,
    WIRES,
    Wire,
    thing_wire,
)
from fulmar_ros.message_class import message_class
from fulmar_ros.operator_subscription import subscribe_every
from fulmar_ros.parameters import read_parameters
from fulmar_ros.qos import EVERYTHING
from fulmar_ros.recorder_health import RecorderHealth
from fulmar_ros.recorder_settings import RecorderSettings
from fulmar_ros.relay import Relay
from fulmar_ros.runtime import RequestExit, run_node

QUIET_S = 0.2  # nothing came for this long: what was published before the stop is here
LONGEST_GOODBYE_S = 2.5  # others may go on publishing for ever; who stops us kills us after 4 s
REMEMBERED = 1024  # messages of a topic: more than one period has
# What plant and estimators publish once more in lock step, and among how many of the newest messages it is looked for.
# Each has a stamp, but for the air bearing: of its states the changes count.
REPEATED = {
    **dict.fromkeys(
        (*SENSOR_WIRES.values(), MOCAP, ACTUATORS_STATE, COMMAND, VELOCITY_COMMAND, PERIOD), REMEMBERED
    ),
    AIR_BEARING: 1,
}
MEASURED = tuple(
    wire for wire in SENSOR_WIRES.values() if wire != ODOMETRY
)  # repeated at the beginning of lock step
REMEMBERED_OF_OTHERS = 32
STAMPED = frozenset(
    (*CAMERA_IMAGES, *CAMERA_COMPRESSED, CAMERA_INFO)
)  # one of each stamp is enough, in lock step
STAMP = slice(4, 12)  # of a message with a header, in CDR
Keep = Callable[[bytes, dict[str, int]], None]


class RecorderNode(Node):
    """Subscribes every recorded wire and keeps the messages as they came."""

    def __init__(self, _request_exit: RequestExit, *, cli_args: list[str] | None = None) -> None:
        """Make the bag, then the subscriptions.

        Args:
            cli_args: ROS arguments of this node alone, where it shares a process.

        Raises:
            BagError: There is a bag already, or it cannot be written.
            ConfigError: A parameter is wrong.
        """
        super().__init__("recorder", cli_args=cli_args)
        self._settings = settings = read_parameters(self, RecorderSettings)
        self._robot = self.get_namespace().strip("/") or "robot"
        self._directory = Path(settings.directory or f"runs/{self._robot}_{time.strftime('%Y%m%d_%H%M%S')}")
        self._run_info, self._attachments = settings.run(), settings.files()
        own = settings.own_wires()
        wires = dict.fromkeys((*WIRES, *own, *(thing_wire(name) for name in settings.things if name)))
        found = {wire: message_class(wire) for wire in wires if wire.recorded or wire in CAMERA_IMAGES}
        classes = {wire: kind for wire, kind in found.items() if kind is not None}
        # The bag names topics as every reader of bags knows them, whatever they are remapped to on the wire.
        self._topics = {wire: self.resolve_topic_name(wire.name, only_expand=True) for wire in classes}
        self._routes = self._routes_of(classes)
        self._ring = self._new_ring() if settings.mode == "ring" else None
        whole = self._bag_per_goal if settings.mode == "goals" else self._open_bag
        before = (json_object(custom_text(self._directory, RECORDING)) or {}) if settings.resume else {}
        warnings = [self._interruption()] if settings.resume else []
        images = {topic for wire, topic in self._topics.items() if wire.type == IMAGE}
        report = self.get_logger().error
        bag = self._ring or whole()
        self._thread = BagThread(
            PackedFrames(bag, images, report) if settings.frames == "compressed" else bag,
            on_error=report,
            before=before,
            patient=settings.lossless,
        )
        self._provenance = threading.Thread(target=self._attach_provenance, name="provenance", daemon=True)
        self._provenance.start()
        commands: list[list[Subscription]] = []
        relays = {space: Relay(self, space) for space in self._spaces}
        for space, wire, topic in self._routes:
            put = self._keep(topic)
            if settings.lossless and wire in REPEATED:
                put = once(put, REPEATED[wire])
            elif settings.lossless and wire in STAMPED:
                put = once(put, REMEMBERED_OF_OTHERS, STAMP)
            elif wire in (*MEASURED, *own):
                put = once(put, REMEMBERED_OF_OTHERS)
            made = subscribe_every(
                self,
                classes[wire],
                wire,
                relays[space].relaying(wire, put),
                topic=f"{space}/{wire.name}" if space and not wire.name.startswith("/") else "",
                depth=EVERYTHING,
                raw=True,
                with_info=True,
                lossless=settings.lossless,
            )
            commands += [made] if wire in (COMMAND, VELOCITY_COMMAND) else []
        self._health = RecorderHealth(
            self,
            self._robot,
            self._directory,
            self._thread.account,
            lambda: self._mode,
            lambda: sum(max(each.get_publisher_count() for each in made) for made in commands),
            warnings=warnings,
        )
        doing = "recording to" if self._ring is None else f"keeping {settings.before_fault_s:g} s for"
        sys.stdout.write(f"{doing} {self._directory}\n")
        sys.stdout.flush()

    @property
    def _spaces(self) -> tuple[str, ...]:
        """Namespaces of the robots of a fleet; of a robot alone an empty one, the node's own."""
        return tuple(f"/{name}" for name in self._settings.robots if name) or ("",)

    def _routes_of(self, wires: Iterable[Wire]) -> list[tuple[str, Wire, str]]:
        """Namespace, wire and absolute topic of all that is recorded, each topic once."""
        found: dict[str, tuple[str, Wire, str]] = {}
        for space in self._spaces:
            for wire in wires:
                whole = self._topics[wire] if not space or wire.name[0] == "/" else f"{space}/{wire.name}"
                found.setdefault(whole, (space, wire, whole))
        return list(found.values())

    @property
    def _mode(self) -> str:
        """What the recorder is doing, in a few words."""
        if self._ring is None:
            return "recording"
        short = ": memory is too small for more" if self._ring.cut_short else ""
        return f"ring: {self._ring.kept_s:.0f} s in memory, {len(self._ring.faults)} faults{short}"

    def _interruption(self) -> str:
        """What the recorder that died before this one has cost."""
        if self._settings.mode == "ring":
            return "the recorder was started again: its memory of the time before is lost"
        last_ns = max((interrupted_bag(bag).last_ns for bag in self._bags()), default=0)
        if not last_ns:
            return "the recorder was started again: nothing was recorded before"
        away_s = max(0.0, (time.time_ns() - last_ns) / 1e9)
        return f"the recorder was started again: nothing was recorded for {away_s:.1f} s"

    def _bags(self) -> tuple[Path, ...]:
        """Folders with bags of this recording: that of the whole bag, or one for each goal."""
        return (self._directory, *sorted(self._directory.glob("goal_[0-9]*")))

    def _open_bag(self, below: str = "") -> BagWriter:
        """Make the bag, or one below its folder, with its topics."""
        bag = BagWriter(
            self._directory / below,
            run_info=self._run_info,
            attachments=self._attachments,
            split_bytes=1e6 * self._settings.split_mb,
            split_s=self._settings.split_s,
            resume=self._settings.resume,
        )
        for _, wire, topic in self._routes:
            bag.add_topic(topic, wire.type, wire.delivery)
            if wire.type == IMAGE and wire not in CAMERA_IMAGES:  # of a sensor of the user's own
                for ending in PACKED_ENDINGS:
                    bag.add_topic(topic + ending, COMPRESSED, wire.delivery)
        return bag

    def _bag_per_goal(self) -> BagPerGoal:
        """A bag for each goal, below the folder of all."""
        if not self._settings.resume:
            check_free(self._directory)
        numbers = [int(bag.name.removeprefix("goal_")) for bag in self._bags()[1:]]
        return BagPerGoal(
            lambda number: self._open_bag(f"goal_{number:03d}"),
            goals={
                topic for wire, topic in self._topics.items() if wire in (*GOAL_WIRES.values(), GOAL_POSES)
            },
            latched=self._latched,
            first=1 + max(numbers, default=0),
        )

    @property
    def _latched(self) -> dict[str, int]:
        """Latched topics, and how many messages of each hold on."""
        return {topic: wire.latest for wire, topic in self._topics.items() if wire.delivery == "latched"}

    def _new_ring(self) -> BagRing:
        """A ring; a folder that cannot be written is refused now, not at the fault.

        Raises:
            BagError: If it could not.
        """
        if not self._settings.resume:
            check_free(self._directory)
        try:
            self._directory.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise BagError(f"{self._directory}: cannot write a bag here: {error.strerror}.") from error
        return BagRing(
            self._open_bag,
            before_s=self._settings.before_fault_s,
            after_s=self._settings.after_fault_s,
            latched=self._latched,
            fault_in=fault_finder(self._robot, self._topics),
            faults=[asdict(each) for each in recorded_faults(custom_text(self._directory, FAULTS))],
        )

    def _keep(self, topic: str) -> Keep:
        """A callback that puts a topic's messages into the bag.

        `log_time` is when the message was received, by the wall clock of this machine; `publish_time` is when it was
        sent, by the wall clock of the sender's machine (the source timestamp of DDS). Both are wall clock also in lock
        step and with simulated time, which only the stamps in the messages follow.
        """
        put = self._thread.put
        return lambda data, info: put(topic, data, time.time_ns(), info["source_timestamp"])

    def _attach_provenance(self) -> None:
        """Attach code version and packages; git and a slow disk may take seconds, while messages come already."""
        for name, data in attachments().items():
            self._thread.attach(name, data)

    def stop(self) -> int:
        """Wait until no more messages come, close the bag, and print its content."""
        deadline = time.monotonic() + LONGEST_GOODBYE_S
        self._provenance.join(LONGEST_GOODBYE_S)
        before = -1
        while (self._thread.received != before or self._thread.is_full) and time.monotonic() < deadline:
            before = self._thread.received
            time.sleep(QUIET_S)
        account = self._thread.stop()
        if self._ring is not None and not self._ring.faults:
            with contextlib.suppress(OSError):  # somebody else has put something into it
                self._directory.rmdir()
            sys.stdout.write(f"no fault in {account.received} messages: nothing was written\n")
        else:
            sys.stdout.write(
                f"recorded {account.recorded} messages, {account.size / 1e3:.0f} kB, to {self._directory}\n"
            )
        sys.stdout.flush()
        if account.lost:
            self.get_logger().error(f"{account.lost} of {account.received} messages are not in the bag.")
        return DONE if account.complete and not account.lost else FAILED


def once(keep: Keep, remembered: int, part: slice = slice(None)) -> Keep:
    """A callback that leaves out what equals one of so many newest messages, in all of its bytes or a part of them."""
    newest: dict[bytes, None] = {}  # in the order in which they came

    def keep_once(data: bytes, info: dict[str, int]) -> None:
        known = data[part]
        if known in newest:
            return
        newest[known] = None
        if len(newest) > remembered:
            del newest[next(iter(newest))]
        keep(data, info)

    return keep_once


def main() -> None:
    """Record until stopped."""
    sys.exit(run_node(RecorderNode))


if __name__ == "__main__":
    main()
