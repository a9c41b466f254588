"""One topic: its type, who publishes it, how, how fast, and whether bags keep it. `topics` has the table of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Source = Literal["plant", "estimator", "controller", "operator", "every node", "display", "camera"]
Delivery = Literal["stream", "latched", "best_effort"]


@dataclass(frozen=True)
class Wire:
    """One topic.

    `delivery` is how publishers offer it: "stream" is reliable with the last 50 kept (in lock step with all that a
    reader has not got), "latched" is reliable and transient-local with the last `latest` (goals that come with each
    step of lock step, as a stream), "best_effort" keeps the last 50.
    """

    name: str
    type: str  # ROS message type
    source: Source
    delivery: Delivery
    rate: str  # for people
    content: str  # for people
    recorded: bool = True
    latest: int = 1  # messages that late subscribers of a latched wire still get
    unit: str = "none"  # of the message's numbers, for people
    frame: str = "none"  # that they are given in, for people
