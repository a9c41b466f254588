"""What a plant sends for a physics step within a period of lock step."""

from __future__ import annotations

import threading
from types import SimpleNamespace
from unittest import mock

from fulmar_core.simulation.backend import Sample
from fulmar_core.wires.reading import Reading
from fulmar_ros.plant_wires import PlantWires


def test_a_step_within_a_period_has_its_readings_alone():
    period, sensors = SimpleNamespace(within=False), mock.Mock()
    sensors.publish = mock.Mock(side_effect=lambda *_given: seen.append(period.within))
    seen: list[bool] = []
    wires = mock.Mock(_period=period, _sensors=sensors, _mocap=mock.Mock(), lock=threading.Condition())
    wires.commands.cuts = lambda _side: False
    wires._mocap.see.return_value = [(7, "pose")]
    wires._publish_readings = lambda *given: PlantWires._publish_readings(wires, *given)
    sample = Sample({"odometry": Reading("state")}, "truth", {"block": "pose of a thing"})
    PlantWires.publish_tick(wires, sample, 9)
    sensors.publish.assert_called_once_with(sample.readings, 9)
    wires._publish_pose.assert_called_once_with(7, "pose")
    wires.commands.note_sent.assert_called_once()
    wires.publish_truth.assert_not_called()  # it would be packed for nothing
    wires._publish_thing.assert_not_called()
    assert (seen, period.within) == ([True], False)
