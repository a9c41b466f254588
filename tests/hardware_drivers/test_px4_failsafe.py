"""Parameters of PX4's failsafe over a real UDP link: set where they do not protect, read again, or refused."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator

import pytest

from fulmar_core.config.errors import DeviceError
from hardware_drivers import px4_failsafe
from hardware_drivers.px4_failsafe import confirm_parameters
from hardware_drivers.px4_settings import Px4Failsafe
from sim_nodes.emulators.parameters import EmulatedParameters, Px4ParameterLink
from tests.hardware_drivers.boat_bench import free_udp_port


class Served:
    """An emulated PX4's parameters, served in a thread."""

    def __init__(self) -> None:
        self.parameters = EmulatedParameters({"COM_OF_LOSS_T": 5.0, "COM_OBL_RC_ACT": 0}, bytewise=True)
        self._link = Px4ParameterLink(free_udp_port(), self.parameters)
        self.address = self._link.address
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self) -> None:
        while not self._over.wait(0.01):
            self._link.serve(time.monotonic())

    def stop(self) -> None:
        self._over.set()
        self._thread.join()
        self._link.close()


@pytest.fixture
def served(monkeypatch) -> Iterator[Served]:
    monkeypatch.setattr(px4_failsafe, "ANSWERS_S", 0.7)
    made = Served()
    yield made
    made.stop()


def test_both_parameters_are_set_as_px4_encodes_them_and_read_again(served):
    confirm_parameters(Px4Failsafe("disarm", "mavlink", loss_s=0.8, mavlink=served.address), 5.0)
    assert served.parameters.values == {"COM_OF_LOSS_T": pytest.approx(0.8), "COM_OBL_RC_ACT": 7}


def test_a_shorter_time_stays(served):
    served.parameters.values = {"COM_OF_LOSS_T": 0.5, "COM_OBL_RC_ACT": 5}
    confirm_parameters(Px4Failsafe("hold", "mavlink", loss_s=1.0, mavlink=served.address), 5.0)
    assert served.parameters.values == {"COM_OF_LOSS_T": 0.5, "COM_OBL_RC_ACT": 5}


def test_a_parameter_that_does_not_take_its_value_is_refused_with_what_to_set(served):
    served.parameters.fixed = {"COM_OBL_RC_ACT"}
    words = (
        r"its parameter COM_OBL_RC_ACT stays 0: set it to 7 \(what PX4 does then: disarm\)\. Nothing is armed"
    )
    with pytest.raises(DeviceError, match=words):
        confirm_parameters(Px4Failsafe("disarm", "mavlink", mavlink=served.address), 5.0)


def test_a_px4_that_says_nothing_of_it_is_refused(served):
    served.parameters.unknown = {"COM_OF_LOSS_T"}
    with pytest.raises(DeviceError, match="says nothing of its parameter COM_OF_LOSS_T: set it to 1"):
        confirm_parameters(Px4Failsafe("disarm", "mavlink", mavlink=served.address), 5.0)


def test_an_address_at_which_no_px4_speaks_is_an_error():
    failsafe = Px4Failsafe("disarm", "mavlink", mavlink=f"udpin:127.0.0.1:{free_udp_port()}")
    with pytest.raises(DeviceError, match="no heartbeat"):
        confirm_parameters(failsafe, 0.3)


def test_others_ask_for_nothing():
    confirm_parameters(Px4Failsafe("disarm", "set_by_hand"), 0.0)
