"""Definitions that are built where ROS comes as wheels: their hashes are those of ROS's own packages.

Computed by rosbags, another implementation than that of ROS's generators; `tests/ros` compares what was built and what
is on the wire.
"""

from __future__ import annotations

import re
from typing import Any

import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from fulmar_bringup.message_build import CONTROL_MSGS, NAV2_MSGS, PACKAGES, SIMULATION_INTERFACES, SOURCE

FOLDER = SOURCE.parent
FEEDBACK = "nav2_msgs/action/NavigateToPose_FeedbackMessage"
SPAWNED = "simulation_interfaces/srv/SpawnEntity_Response"
EMPTY = "uint8 structure_needs_at_least_one_member\n"  # what the generators give a message without fields
EVENT = "service_msgs/msg/ServiceEventInfo"
# As in ROS, whose generators take its char for a number.
EVENT_INFO = "uint8 event_type\nbuiltin_interfaces/Time stamp\nuint8[16] client_gid\nint64 sequence_number\n"
CONSTANT = re.compile(r"\w+ \w+ *=")
# Each as ROS's own generators have published it, in packages that are built from the upstream definitions:
# simulation_interfaces 1.5 for Jazzy and 2.1 have these in common. The feedback is the same in Nav2 1.1 and 1.3.
PUBLISHED = {
    "simulation_interfaces/msg/EntityFilters": "8e7b12e8ea062f14c55de4877221fe1b7cd9749665a7ad8a4ab855fc4b148303",
    "simulation_interfaces/msg/Result": "cf43a306adff3337a0a47143d8f5689933bc70a30478f13b077dc1fe3bc5ad17",
    "simulation_interfaces/msg/SimulationState": "bb9f87ccdd98fba113052a512d9801e84ce732d0a2b3c2b0cb281828de36e415",
    "simulation_interfaces/srv/GetEntities": "cb90004c48cd50f37732fb008e22c34c261dd680a723bf0f85d8437ea4498bf7",
    "simulation_interfaces/srv/GetEntitiesStates": "0a76170d0c1c90e1eaf805cfab78ea801d1f82df309a28c1f0fae4b570f19754",
    "simulation_interfaces/srv/GetSimulationState": "3362dcebee4b1afebbf9c4beee5c79c1455385aded62092a892d61fde8644f30",
    "simulation_interfaces/srv/ResetSimulation": "4ce285d7ff9b8ac70dcc95161f32bf54c05a6f4b13427990e41ab40c36c39646",
    SPAWNED: "be8c9fc03b6faaf95570949c80195c8ca75dd99f7efc23262309d497b2923982",
    "simulation_interfaces/srv/StepSimulation": "913fe0653690ce6bf8f09f316e6a626747012e9fca31e26719910d417aa8565c",
    FEEDBACK: "9d1f6fa2eb975ce733b419ac2e97b134d8ff92b6478b6559feed9a50bdfd82b3",
}


class Definitions:
    """Types of the packages, of their parts and of what the generators make around them."""

    def __init__(self) -> None:
        self.store = get_typestore(Stores.ROS2_JAZZY)
        del self.store.fielddefs[EVENT]
        self.add(EVENT, EVENT_INFO)
        for package in (NAV2_MSGS, SIMULATION_INTERFACES, CONTROL_MSGS):
            for file in sorted((FOLDER / package).rglob("*.msg")):
                self.add(f"{package}/msg/{file.stem}", file.read_text())
            for file in sorted((FOLDER / package).rglob("*.srv")):
                self._add_service(f"{package}/srv/{file.stem}", *file.read_text().split("---\n"))
            for file in sorted((FOLDER / package).rglob("*.action")):
                self._add_feedback(f"{package}/action/{file.stem}", file.read_text().split("---\n")[2])

    def add(self, name: str, text: str) -> None:
        """Register a type; names of its own package may be short, as in the files."""
        package = name.partition("/")[0]
        lines = (line for line in text.splitlines() if line and line[0] != "#" and not CONSTANT.match(line))
        long = [re.sub(r"^([A-Z]\w+)", rf"{package}/\1", line) for line in lines]
        found = get_types_from_msg("\n".join(long) or EMPTY, name)
        self.store.register({name: _named(next(iter(found.values())))})

    def _add_service(self, name: str, request: str, response: str) -> None:
        self.add(f"{name}_Request", request)
        self.add(f"{name}_Response", response)
        pair = f"{name}_Request[<=1] request\n{name}_Response[<=1] response\n"
        self.add(f"{name}_Event", f"service_msgs/ServiceEventInfo info\n{pair}")
        self.add(
            name,
            f"{name}_Request request_message\n{name}_Response response_message\n{name}_Event event_message\n",
        )

    def _add_feedback(self, name: str, feedback: str) -> None:
        self.add(f"{name}_Feedback", feedback)
        self.add(
            f"{name}_FeedbackMessage", f"unique_identifier_msgs/UUID goal_id\n{name}_Feedback feedback\n"
        )

    def hash_of(self, name: str) -> str:
        return self.store.hash_rihs01(name).removeprefix("RIHS01_")


def _named(part: Any) -> Any:
    """A definition whose names of services and actions are those of ROS."""
    if isinstance(part, str):
        return re.sub(r"/(srv|action)/msg/", r"/\1/", part)
    return type(part)(map(_named, part)) if type(part) in (tuple, list) else part


@pytest.fixture(scope="module")
def definitions() -> Definitions:
    return Definitions()


@pytest.mark.parametrize("name", PUBLISHED)
def test_a_type_has_the_hash_of_ros_own_package(name: str, definitions: Definitions) -> None:
    assert definitions.hash_of(name) == PUBLISHED[name]


def test_every_file_is_built_and_licensed() -> None:
    for package in PACKAGES:
        text = (FOLDER / package / "CMakeLists.txt").read_text()
        files = [file for kind in ("msg", "srv", "action") for file in (FOLDER / package / kind).glob("*")]
        assert files
        assert sorted(re.findall(r"^  ((?:msg|srv|action)/[^\s)]+)", text, re.MULTILINE)) == sorted(
            f"{file.parent.name}/{file.name}" for file in files
        )
        assert re.search(r"<license[^>]*>\S+</license>", (FOLDER / package / "package.xml").read_text())
