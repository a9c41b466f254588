"""Bytes of the datagrams of XPlaneConnect, the plugin of X-Plane.

Little-endian; four letters, a zero byte, then the fields. Layouts are those that the plugin's handlers read and write
(nasa/XPlaneConnect at 446780c). Its Python client packs vectors of data references, counts of waypoints and rows of
DATA in ways that the plugin does not read; here they are as the plugin has them.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Sequence

from hardware_drivers.xplane_messages import (
    KEEP,
    TOGGLE,
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
    Message,
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

MOST_AIRCRAFT = 20
LONGEST = 4096  # bytes of the plugin's own buffer
HEADER = 5


class MalformedError(ValueError):
    """A datagram that is not what its head says; the message says why."""


def encode(message: Message) -> bytes:
    """A message as its datagram.

    Raises:
        ValueError: It cannot be sent: a number that is not finite, a name or a list that is too long.
    """
    head, write = WRITERS[type(message)]
    try:
        datagram = head + b"\0" + write(message)
    except (struct.error, OverflowError, UnicodeEncodeError) as error:
        raise ValueError(f"{head.decode()} cannot hold {message}: {error}.") from error
    if len(datagram) > LONGEST:
        raise ValueError(f"{head.decode()} of {len(datagram)} bytes: the plugin reads at most {LONGEST}.")
    decode(datagram)  # rejects values that a receiver rejects
    return datagram


def decode(datagram: bytes) -> Message:
    """Read a datagram.

    Raises:
        MalformedError: It is none of these, too short or too long, has counts that do not fit its length, or numbers
            that are not finite.
    """
    head, body = datagram[:4], datagram[HEADER:]
    if len(datagram) <= HEADER:
        raise MalformedError(f"a datagram of {len(datagram)} bytes is too short")
    reader = READERS.get(head)
    if reader is None or datagram[4]:
        raise MalformedError(f"{datagram[:HEADER]!r} is no head of a datagram")
    try:
        return reader(body)
    except UnicodeDecodeError as error:
        raise MalformedError(f"{head.decode()} holds text that cannot be read") from error
    except MalformedError as error:
        raise MalformedError(f"{head.decode()} of {len(datagram)} bytes: {error}") from error


def _fields(layout: str, body: bytes) -> tuple[float, ...]:
    """All fields of a body of fixed length."""
    if len(body) != struct.calcsize(layout):
        raise MalformedError(f"must have {HEADER + struct.calcsize(layout)}")
    return tuple(_finite(struct.unpack(layout, body)))


def _finite(values: Sequence[float]) -> Sequence[float]:
    if not all(map(math.isfinite, values)):
        raise MalformedError("a number is not finite")
    return values


def _aircraft(number: float) -> int:
    if not 0 <= number <= MOST_AIRCRAFT:
        raise MalformedError(f"aircraft {number:g} must be from 0 to {MOST_AIRCRAFT}")
    return int(number)


class _Cursor:
    """Goes through a body of counted parts."""

    def __init__(self, body: bytes) -> None:
        self._body, self._at = body, 0

    @property
    def over(self) -> bool:
        """Whether everything is read."""
        return self._at == len(self._body)

    def take(self, count: int) -> bytes:
        """The next bytes."""
        part = self._body[self._at : self._at + count]
        if len(part) < count:
            raise MalformedError("a count goes beyond its end")
        self._at += count
        return part

    def number(self) -> int:
        """The next byte."""
        return self.take(1)[0]

    def name(self) -> str:
        """Length and letters of a name."""
        length = self.number()
        if not length:
            raise MalformedError("a name is empty")
        return self.take(length).decode("ascii")

    def floats(self) -> tuple[float, ...]:
        """Count and values."""
        count = self.number()
        return tuple(_finite(struct.unpack(f"<{count}f", self.take(4 * count))))

    def end(self) -> None:
        """Refuse what is left."""
        if not self.over:
            raise MalformedError(f"{len(self._body) - self._at} bytes too many")


def _name(name: str) -> bytes:
    letters = name.encode("ascii")
    return struct.pack("<B", len(letters)) + letters


def _floats(values: Sequence[float]) -> bytes:
    return struct.pack(f"<B{len(values)}f", len(values), *values)


def _write_position(message: Position) -> bytes:
    place = (message.latitude, message.longitude, message.altitude)
    angles = (message.pitch, message.roll, message.heading, message.gear)
    return struct.pack("<B7f" if message.coarse else "<B3d4f", message.aircraft, *place, *angles)


def _read_position(body: bytes) -> Position:
    coarse = len(body) == struct.calcsize("<B7f")
    index, *numbers = _fields("<B7f" if coarse else "<B3d4f", body)
    latitude, longitude, altitude, pitch, roll, heading, gear = numbers
    kept = KEEP in (latitude, longitude)
    if not kept and (abs(latitude) > 90.0 or abs(longitude) > 360.0):
        raise MalformedError(f"latitude {latitude:g}° and longitude {longitude:g}° are not on Earth")
    return Position(
        latitude, longitude, altitude, pitch, roll, heading, gear, aircraft=_aircraft(index), coarse=coarse
    )


def _write_controls(message: Controls) -> bytes:
    sticks = (message.pitch, message.roll, message.yaw, message.throttle)
    body = struct.pack("<4fbf", *sticks, message.gear, message.flaps)
    if message.aircraft is not None:
        body += struct.pack("<B", message.aircraft)
        if message.speed_brake is not None:
            body += struct.pack("<f", message.speed_brake)
    return body


def _read_controls(body: bytes) -> Controls:
    layouts = {struct.calcsize(layout): layout for layout in ("<4fbf", "<4fbfB", "<4fbfBf")}
    layout = layouts.get(len(body))
    if layout is None:
        raise MalformedError("must have 26, 27 or 31")
    pitch, roll, yaw, throttle, gear, flaps, *more = _fields(layout, body)
    return Controls(
        pitch,
        roll,
        yaw,
        throttle,
        int(gear),
        flaps,
        _aircraft(more[0]) if more else None,
        more[1] if len(more) > 1 else None,
    )


def _read_references(body: bytes) -> References:
    cursor, found = _Cursor(body), []
    while not cursor.over:
        name = cursor.name()
        found.append((name, cursor.floats()))
    return References(tuple(found))


def _read_ask_references(body: bytes) -> AskReferences:
    cursor = _Cursor(body)
    names = tuple(cursor.name() for _ in range(cursor.number()))
    cursor.end()
    return AskReferences(names)


def _read_values(body: bytes) -> Values:
    cursor = _Cursor(body)
    values = tuple(cursor.floats() for _ in range(cursor.number()))
    cursor.end()
    return Values(values)


def _read_rows(body: bytes) -> Rows:
    if len(body) % 36:
        raise MalformedError("must have 5 and 36 a row")
    rows = []
    for number, *values in struct.iter_unpack("<I8f", body):
        rows.append((number, tuple(_finite(values))))
    return Rows(tuple(rows))


def _read_text(body: bytes) -> Text:
    cursor = _Cursor(body)
    x, y = struct.unpack("<ii", cursor.take(8))
    words = cursor.take(cursor.number()).decode("ascii")
    cursor.end()
    return Text(words, x, y)


def _write_view(message: View) -> bytes:
    camera = message.camera
    if camera is None:
        return struct.pack("<i", message.view)
    return struct.pack("<i3d4f", message.view, *camera.place, *camera.direction, camera.zoom)


def _read_view(body: bytes) -> View:
    if len(body) == 4:
        return View(int(_fields("<i", body)[0]))
    view, x, y, z, a, b, c, zoom = _fields("<i3d4f", body)
    return View(int(view), Camera((x, y, z), (a, b, c), zoom))


def _read_waypoints(body: bytes) -> Waypoints:
    cursor = _Cursor(body)
    operation, count = cursor.number(), cursor.number()
    if operation not in (1, 2, 3):
        raise MalformedError(f"operation {operation} must be 1, 2 or 3")
    parts = [tuple(_finite(struct.unpack("<3f", cursor.take(12)))) for _ in range(count)]
    cursor.end()
    return Waypoints(operation, tuple((a, b, c) for a, b, c in parts))


def _write_waypoints(message: Waypoints) -> bytes:
    head = struct.pack("<BB", message.operation, len(message.points))
    return head + b"".join(struct.pack("<3f", *point) for point in message.points)


def _read_commands(body: bytes) -> Commands:
    cursor, names = _Cursor(body), []
    while not cursor.over:
        names.append(cursor.name())
    return Commands(tuple(names))


def _read_simulation(body: bytes) -> Simulation:
    state = int(_fields("<B", body)[0])
    if not (state <= TOGGLE or 100 <= state < 120 or 200 <= state < 220):
        raise MalformedError(f"state {state} must be 0 to 2, 100 to 119 or 200 to 219")
    return Simulation(state)


def _read_ask_terrain(body: bytes) -> AskTerrain:
    aircraft, latitude, longitude, altitude = _fields("<B3d", body)
    return AskTerrain(latitude, longitude, altitude, _aircraft(aircraft))


def _read_terrain(body: bytes) -> Terrain:
    index, latitude, longitude, altitude, a, b, c, u, v, w, wet, result = _fields("<B3d6f2i", body)
    return Terrain(
        latitude, longitude, altitude, (a, b, c), (u, v, w), int(wet), int(result), _aircraft(index)
    )


def _read_beacon(body: bytes) -> Beacon:
    cursor = _Cursor(body)
    port, version = struct.unpack("<HI", cursor.take(6))
    plugin, end, _ = body[6:].partition(b"\0")
    if not end:
        raise MalformedError("its version has no end")
    return Beacon(port, version, plugin.decode("ascii"))


def _write_terrain(message: Terrain) -> bytes:
    place = (message.latitude, message.longitude, message.altitude)
    vectors = (*message.normal, *message.velocity)
    return struct.pack("<B3d6f2i", message.aircraft, *place, *vectors, message.wet, message.result)


WRITERS: dict[type, tuple[bytes, Callable[..., bytes]]] = {
    Connect: (b"CONN", lambda m: struct.pack("<H", m.port)),
    Connected: (b"CONF", lambda m: struct.pack("<B", m.connection)),
    Simulation: (b"SIMU", lambda m: struct.pack("<B", m.state)),
    AskPosition: (b"GETP", lambda m: struct.pack("<B", m.aircraft)),
    AskControls: (b"GETC", lambda m: struct.pack("<B", m.aircraft)),
    Position: (b"POSI", _write_position),
    PositionAskTerrain: (b"POST", lambda m: _write_position(m.position)),
    Controls: (b"CTRL", _write_controls),
    References: (b"DREF", lambda m: b"".join(_name(name) + _floats(values) for name, values in m.values)),
    AskReferences: (b"GETD", lambda m: struct.pack("<B", len(m.names)) + b"".join(map(_name, m.names))),
    Values: (b"RESP", lambda m: struct.pack("<B", len(m.values)) + b"".join(map(_floats, m.values))),
    Rows: (b"DATA", lambda m: b"".join(struct.pack("<I8f", row, *values) for row, values in m.rows)),
    Text: (
        b"TEXT",
        lambda m: struct.pack("<iiB", m.x, m.y, len(m.words)) + m.words.encode("ascii"),
    ),
    View: (b"VIEW", _write_view),
    Waypoints: (b"WYPT", _write_waypoints),
    Commands: (b"COMM", lambda m: b"".join(map(_name, m.names))),
    AskTerrain: (
        b"GETT",
        lambda m: struct.pack("<B3d", m.aircraft, m.latitude, m.longitude, m.altitude),
    ),
    Terrain: (b"TERR", _write_terrain),
    Beacon: (b"BECN", lambda m: struct.pack("<HI", m.port, m.xplane) + m.plugin.encode("ascii") + b"\0"),
}
READERS: dict[bytes, Callable[[bytes], Message]] = {
    b"CONN": lambda body: Connect(int(_fields("<H", body)[0])),
    b"CONF": lambda body: Connected(int(_fields("<B", body)[0])),
    b"SIMU": _read_simulation,
    b"GETP": lambda body: AskPosition(_aircraft(_fields("<B", body)[0])),
    b"GETC": lambda body: AskControls(_aircraft(_fields("<B", body)[0])),
    b"POSI": _read_position,
    b"POST": lambda body: PositionAskTerrain(_read_position(body)),
    b"CTRL": _read_controls,
    b"DREF": _read_references,
    b"GETD": _read_ask_references,
    b"RESP": _read_values,
    b"DATA": _read_rows,
    b"TEXT": _read_text,
    b"VIEW": _read_view,
    b"WYPT": _read_waypoints,
    b"COMM": _read_commands,
    b"GETT": _read_ask_terrain,
    b"TERR": _read_terrain,
    b"BECN": _read_beacon,
}
