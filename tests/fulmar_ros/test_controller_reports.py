"""What a controller node says of its odometry, without a wire or a thread."""

from __future__ import annotations

from typing import Any

import pytest
import rclpy
from rclpy.signals import SignalHandlerOptions

from fulmar_core.safety.input_gate import JUMP_M
from fulmar_ros.controller_node import ControllerNode
from fulmar_ros.convert import OdometryWriter
from tests.conftest import RosDomain
from tests.ros.controllers import make_lqr
from tests.ros.neighbour import NAMESPACE
from tests.states import planar_state

MS = 1_000_000


def test_a_place_that_jumps_is_reported_as_a_new_epoch_with_its_reason(
    ros_domain: RosDomain, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.argv", ["controller_node"])
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    arguments = ["--ros-args", "-r", f"__ns:={NAMESPACE}", "-p", "autostart:=false"]
    node: Any = ControllerNode(make_lqr, lambda _code: None, cli_args=arguments)
    try:
        node.trigger_configure()
        node.guard.activate()
        said: list[dict[str, str]] = []
        monkeypatch.setattr(
            node.wires.health, "publish", lambda _level, _words, values, **_: said.append(values)
        )
        write = OdometryWriter(node.robot.sensors.odometry)
        for number in range(1, 10):
            place = 1e-6 * number + (2.0 * JUMP_M if number > 5 else 0.0)
            node._on_odometry(write.raw(planar_state(place, 0.0, 0.0), number * 20 * MS))
            node._status.repeat()
            node._publish_status()
        assert [values["epoch"] for values in said] == ["0"] * 5 + ["1"] * 4
    finally:
        node.stop()
        node.destroy_node()
        rclpy.try_shutdown()
