"""`fulmar bag play --to xplane`: the poses that arrive at an emulated X-Plane, their pace, and what goes wrong."""

from __future__ import annotations

import math
import struct
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from fulmar_bags.contents import open_bag
from fulmar_bags.message_types import type_store
from fulmar_bags.writer import BagWriter
from fulmar_bringup import xplane_player
from fulmar_core.config.errors import BagError, DeviceError
from fulmar_core.robots.topics import ODOMETRY
from fulmar_core.states.attitude import from_euler
from hardware_drivers.ports import UdpPort
from hardware_drivers.xplane_link import XPlaneLink
from tests.fulmar_cli.bag_commands import answer, ask
from tests.hardware_drivers.xplane_bench import Peer

NS = 1_000_000_000
EARTH_M = 6_371_000.0  # a sphere is good to half a percent
POSES = 26  # at 50 Hz


def pose_at(time_s: float) -> tuple[float, ...]:
    """To the north at 28 m/s, climbing at 2 m/s from 1 m, nose 10° up, right wing 20° down."""
    roll, pitch, yaw = (np.array(math.radians(angle)) for angle in (20.0, -10.0, 90.0))
    return 100.0, 28.0 * time_s, 1.0 + 2.0 * time_s, *map(float, from_euler(roll, pitch, yaw))


def write_flight(folder: Path, poses: list[tuple[float, ...]], *, stamped: bool = True) -> Path:
    """A bag with odometry at 50 Hz, recorded ten times as fast, as a lock-step run is."""
    store = type_store()
    new = store.types
    writer = BagWriter(folder, run_info={"robot": "airship_v7"})
    writer.add_topic("/airship_v7/odom", ODOMETRY.type, ODOMETRY.delivery)
    vector, zeros = new["geometry_msgs/msg/Vector3"], np.zeros(36)
    for number, (x, y, z, *quat) in enumerate(poses):
        stamp_ns = 5 * NS + number * NS // 50 if stamped else 0
        message = new[ODOMETRY.type](
            header=new["std_msgs/msg/Header"](
                stamp=new["builtin_interfaces/msg/Time"](*divmod(stamp_ns, NS)), frame_id="airship_v7/odom"
            ),
            child_frame_id="airship_v7/base_link",
            pose=new["geometry_msgs/msg/PoseWithCovariance"](
                pose=new["geometry_msgs/msg/Pose"](
                    position=new["geometry_msgs/msg/Point"](x=x, y=y, z=z),
                    orientation=new["geometry_msgs/msg/Quaternion"](*quat),
                ),
                covariance=zeros,
            ),
            twist=new["geometry_msgs/msg/TwistWithCovariance"](
                twist=new["geometry_msgs/msg/Twist"](
                    linear=vector(x=28.0, y=0.0, z=0.0), angular=vector(x=0.0, y=0.0, z=0.0)
                ),
                covariance=zeros,
            ),
        )
        log_ns = 1_700_000_000 * NS + number * NS // (500 if stamped else 50)
        writer.write("/airship_v7/odom", bytes(store.serialize_cdr(message, ODOMETRY.type)), log_ns=log_ns)
    writer.close()
    return folder


@pytest.fixture
def flight(tmp_path: Path) -> Path:
    return write_flight(tmp_path / "flight", [pose_at(number / 50) for number in range(POSES)])


class Screen:
    """An emulated X-Plane that keeps when each datagram came."""

    def __init__(self) -> None:
        self.received: list[tuple[float, bytes]] = []
        self.peer = Peer(lambda datagram: self.received.append((time.monotonic(), datagram)))

    def of(self, head: bytes) -> list[bytes]:
        return [datagram for _, datagram in self.received if datagram.startswith(head)]

    @property
    def poses(self) -> np.ndarray:
        """Shape (n, 9): number of the aircraft, place, angles and gear of each POSI, then when it came [s]."""
        rows = [
            (*struct.unpack("<5x B3d4f", datagram), came_s)
            for came_s, datagram in self.received
            if datagram.startswith(b"POSI")
        ]
        return np.array(rows)


@pytest.fixture
def screen() -> Iterator[Screen]:
    screen = Screen()
    with screen.peer:
        yield screen


def test_x_plane_is_paused_and_shows_every_pose_at_the_pace_of_the_run(flight: Path, screen: Screen) -> None:
    done = answer("play", flight, "--to", "xplane", "--port", screen.peer.port)
    assert (done["poses"], done["rounds"], done["left_out"]) == (POSES, 1, 0)
    assert done["duration_s"] == pytest.approx(0.5)
    rest = [datagram[:4] for _, datagram in screen.received if not datagram.startswith(b"GET")]
    pauses = screen.of(b"SIMU")  # one, or more where the answer of a busy computer comes late
    assert set(pauses) == {b"SIMU\0\1"}
    assert rest == [b"SIMU"] * len(pauses) + [b"POSI"] * POSES
    poses = screen.poses
    time_s = np.arange(POSES) / 50
    degree = math.radians(1.0) * EARTH_M
    assert (poses[:, 0] == 0.0).all()
    assert poses[:, 1] - 49.5 == pytest.approx(28.0 * time_s / degree, rel=0.01, abs=1e-9)
    assert poses[:, 2] + 3.0 == pytest.approx(100.0 / degree / math.cos(math.radians(49.5)), rel=0.01)
    assert poses[:, 3] == pytest.approx(1.0 + 2.0 * time_s)
    assert poses[:, 4] == pytest.approx(10.0, abs=1e-5)
    assert poses[:, 5] == pytest.approx(20.0, abs=1e-5)
    assert np.remainder(poses[:, 6] + 180.0, 360.0) == pytest.approx(180.0, abs=1e-4)  # nose to the north
    assert (poses[:, 7] == -998.0).all()  # the gear stays
    assert poses[-1, 8] - poses[0, 8] == pytest.approx(0.5, abs=0.1)


def test_a_rate_a_start_and_the_frames_of_x_plane_thin_the_poses_and_keep_the_last(
    flight: Path, screen: Screen
) -> None:
    done = answer(
        "play", flight, "--to", "xplane", "--port", screen.peer.port, "--rate", 4, "--start", 0.2, "--topic", "odom"
    )  # fmt: skip
    poses = screen.poses
    assert done["poses"] == len(poses) < 8
    assert done["duration_s"] == pytest.approx(0.3)
    assert (poses[0, 3], poses[-1, 3]) == pytest.approx((1.4, 2.0))
    assert poses[-1, 8] - poses[0, 8] == pytest.approx(0.075, abs=0.06)


def test_a_loop_begins_again(flight: Path, screen: Screen) -> None:
    film, stop = xplane_player.film_of(open_bag(flight), start_s=0.4), threading.Event()
    timer = threading.Timer(0.4, stop.set)
    timer.start()
    done = xplane_player.show(film, screen.peer.address, loop=True, stop=stop)
    assert done.rounds >= 3
    heads = [datagram[:4] for _, datagram in screen.received]
    assert b"SIMU" not in heads[heads.index(b"POSI") :]


def test_an_x_plane_whose_pause_was_lost_is_asked_again_and_one_that_goes_on_is_shown_nothing(
    flight: Path, screen: Screen, monkeypatch
) -> None:
    """Its physics would move the aircraft away from what is shown."""
    film, spoilt = xplane_player.film_of(open_bag(flight)), iter([b"", b""])
    screen.peer.lie = lambda answer: next(spoilt, answer) if answer.startswith(b"RESP") else answer
    assert xplane_player.show(film, screen.peer.address, rate=20.0).poses
    assert len(screen.of(b"SIMU")) > 2
    screen.received.clear()
    monkeypatch.setattr("hardware_drivers.xplane_link.PAUSE_S", 0.1)
    screen.peer.lie = lambda answer: b"" if answer.startswith(b"RESP") else answer
    with pytest.raises(DeviceError, match=r"0\.1 s of PAUSE were not confirmed\. Does X-Plane run there"):
        xplane_player.show(film, screen.peer.address)
    assert not screen.of(b"POSI")


def test_poses_that_cannot_be_shown_are_left_out_and_counted(tmp_path: Path, screen: Screen) -> None:
    poses = [pose_at(number / 50) for number in range(10)]
    poses[3] = (float("nan"), *poses[3][1:])
    poses[5] = (*poses[5][:3], 0.0, 0.0, 0.0, 0.0)
    bag = write_flight(tmp_path / "spoilt", poses)
    done = ask("play", bag, "--to", "xplane", "--port", screen.peer.port)
    assert "2 poses were left out: they are not finite" in done.stderr
    assert len(screen.poses) == 8
    assert np.isfinite(screen.poses).all()
    nothing = write_flight(tmp_path / "nothing", [poses[3]] * 4)
    with pytest.raises(BagError, match="holds no pose that can be shown"):
        xplane_player.film_of(open_bag(nothing))


def test_a_bag_without_stamps_is_shown_by_its_times_of_recording(tmp_path: Path) -> None:
    bag = write_flight(tmp_path / "plain", [pose_at(number / 50) for number in range(11)], stamped=False)
    film = xplane_player.film_of(open_bag(bag))
    assert film.times_s == pytest.approx(np.arange(11) / 50)


def test_an_x_plane_that_vanishes_ends_the_show_with_one_line(
    flight: Path, screen: Screen, monkeypatch
) -> None:
    monkeypatch.setattr(xplane_player, "SILENT_S", 0.15)
    monkeypatch.setattr(xplane_player, "ASK_S", 0.05)
    film = xplane_player.film_of(open_bag(flight))
    until_s = time.monotonic() + 0.15
    screen.peer.lie = lambda answer: answer if time.monotonic() < until_s else b""
    with pytest.raises(
        DeviceError, match=r"^udp://127\.0\.0\.1:\d+: no answer for 0\.2 s\. Does X-Plane run there"
    ):
        xplane_player.show(film, screen.peer.address)
    assert 3 < len(screen.poses) < POSES


def test_a_port_without_x_plane_is_one_line_and_nothing_is_shown(
    flight: Path, screen: Screen, monkeypatch
) -> None:
    monkeypatch.setattr(xplane_player, "CONNECT_S", 0.1)
    screen.peer.lie = lambda _answer: b""
    done = ask("play", flight, "--to", "xplane", "--port", screen.peer.port)
    assert isinstance(done.exception, DeviceError)
    assert "no answer within 0.1 s. Does X-Plane run there, with the plugin" in str(done.exception)
    assert not screen.of(b"POSI")
    assert not screen.of(b"SIMU")


@pytest.mark.parametrize(
    ("asked", "says"),
    [
        (("--to", "xplan"), "unknown --to 'xplan'. Did you mean 'xplane'?"),
        (("--host", "localhost"), "--host and --port go with --to xplane"),
        (("--to", "xplane", "--clock"), "--clock and --wait go with --to ros"),
        (("--to", "xplane", "--wait", "1"), "--clock and --wait go with --to ros"),
        (("--to", "xplane", "--topic", "odm"), "unknown topic 'odm'. Did you mean 'odom'?"),
        (("--to", "xplane", "--topic", "odom", "--topic", "odom"), "give one --topic, not 2"),
        (("--to", "xplane", "--start", "9"), "the bag is 0.50 s long. Begin earlier."),
    ],
)
def test_options_that_do_not_go_together_are_refused(flight: Path, asked: tuple[str, ...], says: str) -> None:
    done = ask("play", flight, *asked)
    assert says in str(done.exception)


def test_a_network_that_takes_no_datagram_is_one_line_and_leaves_no_port_open(monkeypatch) -> None:
    closed = []

    def unreachable(_port: UdpPort, _data: bytes) -> None:
        raise OSError(101, "Network is unreachable")

    monkeypatch.setattr(UdpPort, "write", unreachable)
    monkeypatch.setattr(UdpPort, "close", lambda _port: closed.append(True))
    with pytest.raises(DeviceError, match="Network is unreachable"):
        XPlaneLink("udp://127.0.0.1:49009", within_s=1.0)
    assert closed
