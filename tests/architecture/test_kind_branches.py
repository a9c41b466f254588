"""No further line asks what kind of vehicle a robot is."""

from __future__ import annotations

from tests.architecture.kind_branches import ASKS, MOST, branches


def test_no_more_lines_ask_for_the_kind_of_a_vehicle_than_did() -> None:
    assert len(list(branches())) <= MOST


def test_a_line_that_asks_is_found() -> None:
    asking = (
        "if robot.flies:",
        "assert isinstance(robot.actuators, Thrusters)",
        "if robot.state_type is State:",
    )
    assert all(map(ASKS.search, asking))
    assert not ASKS.search("return DYNAMICS[robot.kind.name](robot, scenario)")
