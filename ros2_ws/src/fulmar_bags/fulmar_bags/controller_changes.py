"""Controllers that took over on request in a bag: what each is, and from which control step on it controlled."""

from __future__ import annotations

from dataclasses import dataclass

from fulmar_bags.gathered import json_object
from fulmar_bags.wire_reader import Received, WireReader
from fulmar_core.config.errors import ConfigError
from fulmar_core.loop.swap_request import read_request, read_result
from fulmar_core.robots.topics import METADATA, SWAP, SWAP_RESULT


@dataclass(frozen=True)
class ControllerChange:
    """One controller that took over."""

    sha256: str  # of what defines it
    controller: str = ""  # its name; empty: that of a bundle
    bundle: str = ""  # folder of a policy

    @property
    def what(self) -> str:
        """What was asked for, in words."""
        return f"'{self.controller}'" if self.controller else f"the policy of {self.bundle}"


def controller_changes(reader: WireReader) -> tuple[Received, ...]:
    """`ControllerChange`s in their order; requests that failed are left out.

    Answers say which measurement each was the first to act on. In a bag without answers a change counts from the first
    metadata after its request on.
    """
    answers = [(each.log_ns, read_result(each.value)) for each in reader.received(SWAP_RESULT)]
    if answers:
        done = [(log_ns, it) for log_ns, it in answers if it is not None and it.accepted]
        return tuple(
            Received(log_ns, it.stamp_ns, ControllerChange(it.sha256, it.controller, it.bundle))
            for log_ns, it in done
            if it.stamp_ns
        )
    requests = reader.received(SWAP)
    reports = [(each.log_ns, json_object(each.value) or {}) for each in reader.received(METADATA)]
    ends = [each.log_ns for each in requests[1:]] + [1 << 63]
    found = []
    for request, end in zip(requests, ends, strict=False):
        new = [
            (log, text) for log, text in reports if request.log_ns <= log < end and not text.get("fallback")
        ]
        if new and (asked := _change(request.value, str(new[0][1].get("sha256") or ""))) is not None:
            found.append(Received(new[0][0], 0, asked))
    return tuple(found)


def _change(text: str, sha256: str) -> ControllerChange | None:
    """What a request asked for; None where it is none."""
    try:
        request = read_request(text)
    except ConfigError:
        return None
    return ControllerChange(sha256, request.controller, request.bundle)
