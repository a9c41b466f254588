"""Sentences of the Kingfisher: those that a real boat sent, and whatever else a cable may bring."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hardware_drivers.kingfisher_protocol import Decoder, Fix, Inertial, Rates, drive, read, sentence
from sim_nodes.emulators.kingfisher import TIMEOUT_S, KingfisherEmulator
from tests.hardware_drivers.test_kobuki_protocol import Wire

# Recorded on a real boat of this family on the Charles River, from the comments of the open M200 simulator of MOOS-IvP.
RECORDED = b"""$CPIMU,164958.858,-0.061035,-0.000097,-0.061035,-0.026916,0.104533,-0.932172*57
$GPRMC,164959.00,A,4221.71114,N,07105.44878,W,0.145,156.78,311214,,,A*70
$CPNVG,164959.034,4221.711142,N,7105.44878,W,1,0,0,234.32964,-6.796959,-1.706798,164959.006*78
$CPNVR,164959.063,0.02941,-0.068552,0,0.060938,0,-0.061132*59
$CPRCM,164959.065,0,234.326694,-1.655603,-6.628557,164959.060*62
"""


def recorded() -> list:
    return [read(fields) for fields in Decoder().feed(RECORDED)]


def test_every_sentence_of_the_real_boat_is_sound():
    decoder = Decoder()
    assert len(decoder.feed(RECORDED)) == 5
    assert decoder.lost == 0


def test_the_real_boat_s_place_motion_and_gravity_are_understood():
    imu, _, fix, rates, _ = recorded()
    assert isinstance(fix, Fix)
    assert (fix.latitude, fix.longitude) == pytest.approx((42.3618524, -71.0908130), abs=1e-6)
    assert fix.heading == pytest.approx(234.32964)
    assert fix.time_s == pytest.approx(16 * 3600 + 49 * 60 + 59.006)
    # Its GPS reported the same at that moment: 0.145 knots on a course of 156.78°.
    assert isinstance(rates, Rates)
    assert math.hypot(rates.east, rates.north) == pytest.approx(0.145 * 1852 / 3600, rel=0.01)
    assert math.degrees(math.atan2(rates.east, rates.north)) == pytest.approx(156.78, abs=0.1)
    assert isinstance(imu, Inertial)
    assert imu.reading.specific_force[2] == pytest.approx(9.14, abs=0.01)  # upwards at rest (REP-145)


def test_full_ahead_and_astern_are_the_sentence_of_the_firmware():
    assert drive(1.0, -0.5) == sentence("PYDIR,100.0,-50.0")
    assert sentence("PYDIR,0,0") == b"$PYDIR,0,0*56\r\n"


@given(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0))
def test_the_boat_understands_every_command_as_it_was_meant(left, right):
    wire = Wire()
    boat = KingfisherEmulator(wire)
    wire.coming = drive(left, right)
    assert boat.command(1.0) == pytest.approx(np.clip((left, right), -1.0, 1.0), abs=6e-4)


@pytest.mark.parametrize("command", [(math.nan, 1.0), (1.0, math.nan), (math.inf, 1.0), (0.0, -math.inf)])
def test_a_command_that_is_no_number_is_a_stop_of_both_propellers(command):
    assert drive(*command) == sentence("PYDIR,0.0,0.0")


def test_a_boat_without_commands_stops_after_its_own_timeout():
    wire = Wire()
    boat = KingfisherEmulator(wire)
    wire.coming = drive(1.0, 1.0)
    assert boat.command(5.0).all()
    assert boat.command(5.0 + TIMEOUT_S - 0.01).all()
    assert not boat.command(5.0 + TIMEOUT_S + 0.01).any()


def test_a_spoilt_command_does_not_reach_the_propellers():
    wire = Wire()
    boat = KingfisherEmulator(wire)
    wire.coming = drive(1.0, 1.0).replace(b"100.0,100.0", b"100.0,900.0")
    assert not boat.command(1.0).any()


@given(st.integers(0, 94), st.integers(1, 127))
def test_a_spoilt_character_never_makes_another_fix(place, change):
    line = bytearray(RECORDED.splitlines(keepends=True)[2])
    line[place % (len(line) - 1)] ^= change
    for fields in Decoder().feed(bytes(line)):
        assert not isinstance(read(fields), Fix)


@given(
    st.lists(st.text(max_size=12), min_size=1, max_size=15),
    st.sampled_from(["CPNVG", "CPNVR", "CPIMU", "CPRBS"]),
)
def test_any_fields_are_survived_and_what_is_read_is_finite(fields, name):
    message = read([name, *fields])
    if isinstance(message, Fix):
        assert abs(message.latitude) <= 90.0
        assert math.isfinite(message.heading)
    if isinstance(message, Rates):
        assert math.isfinite(message.east + message.north + message.yaw_rate)


@pytest.mark.parametrize("huge", ["1e308", "-1e308", "1e7", "inf", "nan"])
@pytest.mark.parametrize("field", range(2, 8))
def test_an_inertial_reading_of_no_sensible_size_is_refused(field, huge):
    fields = ["CPIMU", "164958.858", "0", "0", "0", "0", "0", "-1"]
    assert isinstance(read(fields), Inertial)
    fields[field] = huge
    assert read(fields) is None


@given(st.binary(max_size=600))
def test_noise_is_survived_and_the_next_sentence_is_found(noise):
    decoder = Decoder()
    decoder.feed(noise + b"\n")
    assert decoder.feed(RECORDED.splitlines(keepends=True)[3]) == [
        ["CPNVR", "164959.063", "0.02941", "-0.068552", "0", "0.060938", "0", "-0.061132"]
    ]


def test_a_line_that_never_ends_does_not_fill_the_memory():
    decoder = Decoder()
    for _ in range(100):
        decoder.feed(b"$" * 1000)
    assert decoder.lost >= 99
