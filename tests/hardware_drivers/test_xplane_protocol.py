"""Datagrams of XPlaneConnect: golden bytes of every message, written by hand, and whatever else a wire may bring."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hardware_drivers.xplane_messages import (
    KEEP,
    PAUSE,
    AskControls,
    AskPosition,
    AskReferences,
    AskTerrain,
    Beacon,
    Camera,
    Commands,
    Connect,
    Connected,
    Controls,
    Position,
    PositionAskTerrain,
    References,
    Rows,
    Simulation,
    Terrain,
    Text,
    Values,
    View,
    Waypoints,
)
from hardware_drivers.xplane_protocol import LONGEST, READERS, MalformedError, decode, encode

# float32: 1 = 0000803f, 2 = 00000040, 0.5 = 0000003f, 0.25 = 0000803e, -0.5 = 000000bf, -1.5 = 0000c0bf, 10 = 00002041,
# 90 = 0000b442, 49.5 = 00004642, 6.25 = 0000c840, 100 = 0000c842, -998 = 008079c4.
# float64: 49.5 = 0000000000c04840, 6.25 = 0000000000001940, 100 = 0000000000005940, -998 = 0000000000308fc0.
DOUBLES = "0000000000c04840 0000000000001940 0000000000005940"
GOLDEN = {
    "CONN": ("434f4e4e 00 71bf", Connect(49009)),
    "CONF": ("434f4e46 00 03", Connected(3)),
    "SIMU": ("53494d55 00 01", Simulation(PAUSE)),
    "SIMU of one aircraft": ("53494d55 00 cd", Simulation(205)),
    "GETP": ("47455450 00 00", AskPosition()),
    "GETC": ("47455443 00 14", AskControls(20)),
    "POSI": (
        f"504f5349 00 02 {DOUBLES} 00002041 0000c0bf 0000b442 0000803f",
        Position(49.5, 6.25, 100.0, 10.0, -1.5, 90.0, 1.0, aircraft=2),
    ),
    "POSI that keeps place and gear": (
        "504f5349 00 00 0000000000308fc0 0000000000308fc0 0000000000308fc0 00002041 0000c0bf 0000b442 008079c4",
        Position(KEEP, KEEP, KEEP, 10.0, -1.5, 90.0),
    ),
    "POSI in float32": (
        "504f5349 00 02 00004642 0000c840 0000c842 00002041 0000c0bf 0000b442 0000803f",
        Position(49.5, 6.25, 100.0, 10.0, -1.5, 90.0, 1.0, aircraft=2, coarse=True),
    ),
    "POST": (
        f"504f5354 00 02 {DOUBLES} 00002041 0000c0bf 0000b442 0000803f",
        PositionAskTerrain(Position(49.5, 6.25, 100.0, 10.0, -1.5, 90.0, 1.0, aircraft=2)),
    ),
    "CTRL of 26": (
        "4354524c 00 0000803e 000000bf 0000803f 008079c4 ff 0000003f",
        Controls(0.25, -0.5, 1.0, KEEP, -1, 0.5, aircraft=None),
    ),
    "CTRL of 27": (
        "4354524c 00 0000803e 000000bf 0000803f 008079c4 ff 008079c4 00",
        Controls(0.25, -0.5, 1.0, KEEP),
    ),
    "CTRL of 31, as its answer": (
        "4354524c 00 0000803e 000000bf 0000803f 0000003f 01 00000000 02 000000bf",
        Controls(0.25, -0.5, 1.0, 0.5, 1, 0.0, aircraft=2, speed_brake=-0.5),
    ),
    "DREF": (
        "44524546 00 03 612f62 02 0000003f 0000803e 01 63 01 0000803f",
        References((("a/b", (0.5, 0.25)), ("c", (1.0,)))),
    ),
    "GETD": ("47455444 00 02 03 612f62 01 63", AskReferences(("a/b", "c"))),
    "GETD as the last time": ("47455444 00 00", AskReferences()),
    "RESP": ("52455350 00 02 02 0000003f 0000803e 00", Values(((0.5, 0.25), ()))),
    "DATA": (
        "44415441 00 03000000 0000803f 00000040 0000003f 0000803e 000000bf 0000c0bf 00002041 0000b442",
        Rows(((3, (1.0, 2.0, 0.5, 0.25, -0.5, -1.5, 10.0, 90.0)),)),
    ),
    "TEXT": ("54455854 00 0a000000 ffffffff 02 4869", Text("Hi", 10, -1)),
    "VIEW": ("56494557 00 49000000", View(73)),
    "VIEW with a camera": (
        f"56494557 00 49000000 {DOUBLES} 00002041 0000c0bf 0000b442 0000803f",
        View(73, Camera((49.5, 6.25, 100.0), (10.0, -1.5, 90.0), 1.0)),
    ),
    "WYPT": (
        "57595054 00 01 02 00004642 0000c840 0000c842 00002041 0000c0bf 0000b442",
        Waypoints(1, ((49.5, 6.25, 100.0), (10.0, -1.5, 90.0))),
    ),
    "WYPT that clears": ("57595054 00 03 00", Waypoints(3)),
    "COMM": ("434f4d4d 00 03 612f62 01 63", Commands(("a/b", "c"))),
    "GETT": (f"47455454 00 02 {DOUBLES}", AskTerrain(49.5, 6.25, 100.0, 2)),
    "GETT below the aircraft": (
        "47455454 00 00 0000000000308fc0 0000000000308fc0 0000000000308fc0",
        AskTerrain(),
    ),
    "TERR": (
        f"54455252 00 02 {DOUBLES} 0000003f 0000803f 0000803e 00000040 000000bf 0000c0bf 01000000 00000000",
        Terrain(49.5, 6.25, 100.0, (0.5, 1.0, 0.25), (2.0, -0.5, -1.5), 1, 0, 2),
    ),
    "BECN": ("4245434e 00 71bf fc2b0000 312e33 00", Beacon(49009, 11260, "1.3")),
}
SHORT = (
    "CONN",
    "SIMU",
    "GETP",
    "POSI",
    "CTRL of 27",
    "DREF",
    "RESP",
    "DATA",
    "TEXT",
    "WYPT",
    "GETT",
    "TERR",
    "BECN",
)

OTHERS = {
    "POSI": {34},
    "CTRL of 27": {26},
    "DREF": {18},
}  # lengths that are a message again: older, or with less


def golden(name: str) -> bytes:
    return bytes.fromhex(GOLDEN[name][0])


def test_every_kind_of_message_has_golden_bytes():
    assert {golden(name)[:4] for name in GOLDEN} == set(READERS)


@pytest.mark.parametrize("name", GOLDEN)
def test_a_message_is_the_bytes_that_the_plugin_reads(name):
    assert encode(GOLDEN[name][1]) == golden(name)


@pytest.mark.parametrize("name", GOLDEN)
def test_the_bytes_of_the_plugin_are_the_message(name):
    assert decode(golden(name)) == GOLDEN[name][1]


@pytest.mark.parametrize("name", SHORT)
def test_a_datagram_that_is_cut_is_refused(name):
    whole = golden(name)
    for length in set(range(len(whole))) - OTHERS.get(name, set()):
        with pytest.raises(MalformedError):
            decode(whole[:length])


@pytest.mark.parametrize("name", [name for name in GOLDEN if not name.startswith("BECN")])
def test_a_byte_too_many_is_refused(name):
    with pytest.raises(MalformedError):
        decode(golden(name) + b"\x07" + b"x" * (3 if name == "CTRL of 26" else 0))


@pytest.mark.parametrize("head", [b"POSX\0", b"posi\0", b"POSI\1", b"\0\0\0\0\0", b"CTRLO"])
def test_a_wrong_head_is_refused(head):
    with pytest.raises(MalformedError, match="is no head of a datagram"):
        decode(head + golden("POSI")[5:])


@pytest.mark.parametrize(
    ("name", "place", "byte", "says"),
    [
        ("RESP", 5, 3, "a count goes beyond its end"),
        ("RESP", 5, 1, "1 bytes too many"),
        ("RESP", 6, 200, "a count goes beyond its end"),
        ("GETD", 5, 9, "a count goes beyond its end"),
        ("GETD", 6, 0, "a name is empty"),
        ("DREF", 9, 250, "a count goes beyond its end"),
        ("TEXT", 13, 40, "a count goes beyond its end"),
        ("WYPT", 6, 1, "12 bytes too many"),
        ("WYPT", 6, 6, "a count goes beyond its end"),  # as the plugin's own Python client counts: in numbers
        ("WYPT", 5, 7, "operation 7 must be 1, 2 or 3"),
        ("COMM", 5, 99, "a count goes beyond its end"),
        ("SIMU", 5, 3, "state 3 must be 0 to 2"),
        ("GETP", 5, 21, "aircraft 21 must be from 0 to 20"),
        ("POSI", 5, 200, "aircraft 200 must be from 0 to 20"),
        ("COMM", 6, 0xE9, "holds text that cannot be read"),
    ],
)
def test_counts_and_numbers_that_lie_are_refused(name, place, byte, says):
    spoilt = bytearray(golden(name))
    spoilt[place] = byte
    with pytest.raises(MalformedError, match=says):
        decode(bytes(spoilt))


@pytest.mark.parametrize("spoilt", ["0000c07f", "0000807f", "000080ff"], ids=["NaN", "inf", "-inf"])
@pytest.mark.parametrize(
    ("name", "place"), [("POSI", 30), ("CTRL of 27", 9), ("DREF", 10), ("RESP", 7), ("DATA", 9), ("WYPT", 7)]
)
def test_numbers_that_are_not_finite_are_refused(name, place, spoilt):
    datagram = bytearray(golden(name))
    datagram[place : place + 4] = bytes.fromhex(spoilt)
    with pytest.raises(MalformedError, match="not finite"):
        decode(bytes(datagram))


def test_a_latitude_that_is_not_a_number_or_not_on_earth_is_refused():
    datagram = golden("POSI")
    for spoilt in ("000000000000f87f", "0000000000c05840"):  # NaN, and 99
        with pytest.raises(MalformedError):
            decode(datagram[:6] + bytes.fromhex(spoilt) + datagram[14:])


@pytest.mark.parametrize(
    "message",
    [
        Controls(float("nan"), 0.0, 0.0, 0.0),
        Position(0.0, 0.0, float("inf"), 0.0, 0.0, 0.0),
        References((("a", (float("nan"),)),)),
        References((("x" * 256, (1.0,)),)),
        References((("a", (1.0,) * 256),)),
        AskReferences(("",)),
        AskReferences(("sim/é",)),
        AskReferences(tuple(f"sim/a/long/name/of/a/reference/{number:03}" for number in range(200))),
        Waypoints(1, ((0.0, 0.0, 0.0),) * 256),
        Position(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, aircraft=300),
        Connect(70000),
        Simulation(50),
    ],
    ids=lambda message: type(message).__name__,
)
def test_values_that_a_receiver_rejects_are_not_sent(message):
    with pytest.raises(ValueError):
        encode(message)


def test_a_datagram_longer_than_the_plugin_s_buffer_is_not_sent():
    names = tuple(f"sim/a/long/name/of/a/reference/{number:03}" for number in range(200))
    with pytest.raises(ValueError, match=f"at most {LONGEST}"):
        encode(Commands(names))


@given(st.sampled_from(sorted(READERS)), st.binary(max_size=120))
def test_any_bytes_are_a_message_or_malformed_and_nothing_else(head, body):
    try:
        message = decode(head + b"\0" + body)
    except MalformedError:
        return
    assert decode(encode(message)) == message
