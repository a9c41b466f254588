"""The `metadata.yaml` of a bag folder, rosbag2 version 9 as Jazzy writes it."""

from __future__ import annotations

import copy
import functools
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from fulmar_core.config import yaml_text
from fulmar_core.config.atomic_write import write_whole
from fulmar_core.config.bounded_file import RECORD_BYTES, RefusedFileError, read_bounded

METADATA_FILE = "metadata.yaml"
# Ten times as fast, where PyYAML was built with it; this runs twice a second beside everything that controls.
_DUMPER = getattr(yaml, "CSafeDumper", yaml.SafeDumper)


@dataclass(frozen=True)
class TopicCount:
    """One topic of a bag and what it holds of it."""

    name: str
    type_name: str
    type_hash: str
    qos: list[dict[str, Any]]  # offered by its publishers
    messages: int


@dataclass(frozen=True)
class BagSpan:
    """How much a bag, or one file of it, holds, and when."""

    messages: int
    start_ns: int
    end_ns: int


def write_metadata(
    directory: Path, files: Mapping[str, BagSpan], topics: Sequence[TopicCount], custom: Mapping[str, str]
) -> None:
    """Write or replace `metadata.yaml` at once: spans of the MCAP files by name, topics, and texts of `custom_data`.

    Raises:
        OSError: The disk refuses; what was there stays.
    """
    whole = _together(files.values())
    information = {
        "version": 9,
        "storage_identifier": "mcap",
        **_times(whole),
        "message_count": whole.messages,
        "topics_with_message_count": [
            {
                "topic_metadata": {
                    "name": topic.name,
                    "type": topic.type_name,
                    "serialization_format": "cdr",
                    "offered_qos_profiles": topic.qos,
                    "type_description_hash": topic.type_hash,
                },
                "message_count": topic.messages,
            }
            for topic in topics
        ],
        "compression_format": "",  # of the rosbag2 kind; MCAP compresses its own chunks
        "compression_mode": "",
        "relative_file_paths": list(files),
        "files": [
            {"path": name, **_times(span), "message_count": span.messages} for name, span in files.items()
        ],
        "custom_data": dict(custom),
        "ros_distro": "jazzy",
    }
    # A deep copy of its own for each place, because other YAML readers need not know aliases.
    document = {"rosbag2_bagfile_information": _without_sharing(information)}
    text = yaml.dump(document, Dumper=_DUMPER, sort_keys=False, width=10**6)
    write_whole({directory / METADATA_FILE: text.encode()})


def read_information(directory: Path) -> dict[str, Any]:
    """Content of the `metadata.yaml` of a folder, empty where there is none that can be read; not to be changed."""
    try:
        said = (directory / METADATA_FILE).stat()
    except OSError:
        return {}
    return _information(directory, said.st_mtime_ns, said.st_size)


@functools.lru_cache(maxsize=4)  # of one bag it is asked several times
def _information(directory: Path, _changed_ns: int, _size: int) -> dict[str, Any]:
    try:
        found = yaml_text.load(read_bounded(directory / METADATA_FILE, RECORD_BYTES).decode())[
            "rosbag2_bagfile_information"
        ]
    except (OSError, UnicodeDecodeError, yaml_text.YamlError, KeyError, TypeError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}


def metadata_refusal(directory: Path) -> str:
    """Why the `metadata.yaml` of a folder is not read at all; empty where it is, or where there is none."""
    try:
        read_bounded(directory / METADATA_FILE, RECORD_BYTES)
    except RefusedFileError as error:
        return f"{METADATA_FILE} is not read: {error.strerror}."
    except OSError:
        return ""
    return ""


def read_custom(directory: Path) -> dict[str, str]:
    """Texts by name in the `custom_data` of a folder."""
    custom = read_information(directory).get("custom_data")
    return {str(k): v for k, v in custom.items() if isinstance(v, str)} if isinstance(custom, dict) else {}


def _times(span: BagSpan) -> dict[str, dict[str, int]]:
    return {
        "duration": {"nanoseconds": span.end_ns - span.start_ns},
        "starting_time": {"nanoseconds_since_epoch": span.start_ns},
    }


def _together(spans: Iterable[BagSpan]) -> BagSpan:
    """One span over several; those without messages have no times."""
    some = [span for span in spans if span.messages]
    return BagSpan(
        messages=sum(span.messages for span in some),
        start_ns=min((span.start_ns for span in some), default=0),
        end_ns=max((span.end_ns for span in some), default=0),
    )


def _without_sharing(value: object) -> object:
    if isinstance(value, dict):
        return {key: _without_sharing(part) for key, part in value.items()}
    if isinstance(value, list):
        return [_without_sharing(part) for part in value]
    return copy.copy(value)
