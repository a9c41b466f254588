"""Bags of other programs, whatever their storage and whatever became of them: read, or said to be missing."""

from __future__ import annotations

import gc
import os
import sqlite3
import subprocess
import sys
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import CompressionType, Writer
from rosbags.highlevel import AnyReader
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2.enums import CompressionMode, StoragePlugin
from rosbags.typesys import Stores, get_typestore

from fulmar_bags import mcap_records
from fulmar_bags.contents import Bag, open_bag
from fulmar_bags.decode import odometries
from fulmar_bags.figures import describe
from fulmar_bags.message_types import message_type, type_store
from fulmar_bags.stored_bytes import Payloads, Room
from fulmar_core.config.errors import BagError
from tests.foreign_bag import NS, ODOMETRY, write_foreign

TOPIC = "/base/odometry"


def counts(bag: Bag) -> dict[str, int]:
    return {name: len(topic) for name, topic in bag.topics.items()}


def counts_by_rosbags(path: Path) -> dict[str, int]:
    found: dict[str, int] = {}
    with AnyReader([path]) as reader:
        for connection, _, _ in reader.messages():
            found[connection.topic] = found.get(connection.topic, 0) + 1
    return found


def written_in_wal(folder: Path, *, checkpointed: int, logged: int) -> Path:
    """A bag of sqlite3 whose recorder was killed: its newest messages are in the write-ahead log alone."""
    bag = write_foreign(folder, StoragePlugin.SQLITE3, count=checkpointed + logged)
    (file,) = bag.glob("*.db3")
    program = f"""
import os, sqlite3
base = sqlite3.connect({str(file)!r})
rows = base.execute("SELECT * FROM messages ORDER BY id").fetchall()
base.execute("DELETE FROM messages")
base.commit()
base.execute("PRAGMA journal_mode = WAL")
base.execute("PRAGMA wal_autocheckpoint = 0")
marks = ", ".join("?" * len(rows[0]))
base.executemany(f"INSERT INTO messages VALUES ({{marks}})", rows[: len(rows) // 2])
base.commit()
base.execute("PRAGMA wal_checkpoint")
base.executemany(f"INSERT INTO messages VALUES ({{marks}})", rows[len(rows) // 2 :])
base.commit()
os._exit(0)
"""
    subprocess.run([sys.executable, "-c", program], check=True)
    (bag / f"{file.name}-shm").unlink()
    assert (bag / f"{file.name}-wal").stat().st_size > 0
    return bag


@pytest.mark.parametrize("writable", [True, False], ids=["", "in a folder that cannot be written"])
def test_what_only_the_log_of_a_killed_recorder_has_is_read_and_nothing_is_changed(tmp_path, writable):
    bag = written_in_wal(tmp_path / "bag", checkpointed=100, logged=100)
    before = {file.name: file.read_bytes() for file in bag.iterdir()}
    bag.chmod(0o755 if writable else 0o555)
    opened = open_bag(bag)
    assert counts(opened) == {TOPIC: 200, "/words": 4}
    assert not opened.warnings
    assert {file.name: file.read_bytes() for file in bag.iterdir()} == before


@pytest.mark.parametrize("share", [0.3, 0.5, 0.9, 0.99])
def test_a_torn_database_gives_what_is_sound_of_it_and_says_how_to_get_more(tmp_path, share):
    bag = write_foreign(tmp_path / "bag", StoragePlugin.SQLITE3, count=400)
    whole = open_bag(bag).odometry()
    (file,) = bag.glob("*.db3")
    content = file.read_bytes()
    file.write_bytes(content[: int(share * len(content))])
    opened = open_bag(bag)
    found = opened.odometry()
    assert 0.6 * share * 400 < len(found) < 400
    known = dict(zip(whole.log_ns, whole.data, strict=True))
    assert all(known[log_ns] == data for log_ns, data in zip(found.log_ns, found.data, strict=True))
    assert ".recover" in opened.warnings[0]


def test_a_page_in_the_middle_of_a_database_costs_its_messages_alone(tmp_path):
    bag = write_foreign(tmp_path / "bag", StoragePlugin.SQLITE3, count=400)
    (file,) = bag.glob("*.db3")
    content = bytearray(file.read_bytes())
    middle = len(content) // 2 // 4096 * 4096
    content[middle : middle + 4096] = b"\xff" * 4096
    file.write_bytes(content)
    opened = open_bag(bag)
    assert 390 < sum(counts(opened).values()) < 408
    assert "messages" in opened.warnings[0]


def test_a_database_without_its_tables_is_refused_in_one_line_that_helps(tmp_path):
    (tmp_path / "bag.db3").write_bytes(b"SQLite format 3\0" + bytes(5000))
    with pytest.raises(BagError, match=r"cannot be read: .*sqlite3 .*\.recover") as caught:
        open_bag(tmp_path / "bag.db3")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("said", ["", "sqlite3"])
def test_of_two_storages_in_a_folder_the_other_is_named(tmp_path, said):
    bag = write_foreign(tmp_path / "bag", StoragePlugin.SQLITE3)
    other = write_foreign(tmp_path / "other", StoragePlugin.MCAP, count=50)
    (file,) = other.glob("*.mcap")
    file.rename(bag / "more.mcap")
    if not said:
        (bag / "metadata.yaml").unlink()
    opened = open_bag(bag)
    assert opened.storage == (said or "mcap")
    left_out = "more.mcap" if said else "bag.db3"
    assert any(line.startswith(f"{left_out} is left out: the folder holds") for line in opened.warnings)


def test_a_file_that_is_there_packed_and_unpacked_is_read_once(tmp_path):
    bag = write_foreign(tmp_path / "bag", StoragePlugin.MCAP, compression=CompressionMode.FILE)
    (packed,) = bag.glob("*.zstd")
    twin = write_foreign(tmp_path / "twin", StoragePlugin.MCAP)
    (file,) = twin.glob("*.mcap")
    file.rename(bag / packed.name.removesuffix(".zstd"))
    opened = open_bag(bag)
    assert len(opened.odometry()) == 200
    assert any("it is there unpacked, too" in line for line in opened.warnings)


def out_of_order(path: Path, source: Path) -> Path:
    """The messages of a bag in MCAP, their times of recording shuffled within the file."""
    bag = open_bag(source)
    topics = bag.topics.values()
    rows = [(topic, *row) for topic in topics for row in zip(topic.log_ns, topic.data, strict=True)]
    np.random.default_rng(7).shuffle(rows)  # type: ignore[arg-type]
    with path.open("wb") as stream:
        writer = Writer(stream, compression=CompressionType.LZ4)
        writer.start(profile="ros2", library="tests")
        channels = {}
        for topic in bag.topics.values():
            schema = writer.register_schema(
                topic.type, "ros2msg", message_type(topic.type).definition.encode()
            )
            channels[topic.name] = writer.register_channel(topic.name, "cdr", schema)
        for topic, log_ns, data in rows:
            writer.add_message(channels[topic.name], log_ns, data, log_ns)
        writer.finish()
    return path


def test_messages_that_do_not_lie_in_the_order_of_their_recording_are_brought_into_it(tmp_path):
    source = write_foreign(tmp_path / "bag", StoragePlugin.MCAP, commands=True, stamped=False)
    straight, mixed = open_bag(source), open_bag(out_of_order(tmp_path / "mixed.mcap", source))
    for name, topic in straight.topics.items():
        assert list(mixed.topics[name].log_ns) == list(topic.log_ns)
        assert mixed.topics[name].data == topic.data
    keys = ("count", "rate_hz", "gaps", "longest_gap_s")
    rates = [
        [{key: each[key] for key in keys} for each in describe(bag)["topics"]] for bag in (straight, mixed)
    ]
    assert rates[0] == rates[1]


def ros1_bag(path: Path, compression: Ros1Writer.CompressionFormat | None, count: int = 300) -> Path:
    store = get_typestore(Stores.ROS1_NOETIC)
    new = store.types
    writer = Ros1Writer(path)
    if compression is not None:
        writer.set_compression(compression)
    with writer:
        odometry = writer.add_connection("/odom", ODOMETRY, typestore=store)
        words = writer.add_connection("/words", "std_msgs/msg/String", typestore=store)
        for i in range(count):
            time_ns = 5 * NS + i * 20_000_000
            header = new["std_msgs/msg/Header"](
                seq=i, stamp=new["builtin_interfaces/msg/Time"](*divmod(time_ns, NS)), frame_id="odom"
            )
            pose = new["geometry_msgs/msg/Pose"](
                new["geometry_msgs/msg/Point"](0.01 * i, 0.0, 0.0),
                new["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0),
            )
            zero = new["geometry_msgs/msg/Vector3"](0.0, 0.0, 0.0)
            ahead = new["geometry_msgs/msg/Vector3"](0.5, 0.0, 0.0)
            message = new[ODOMETRY](
                header,
                "base_footprint",
                new["geometry_msgs/msg/PoseWithCovariance"](pose, np.zeros(36)),
                new["geometry_msgs/msg/TwistWithCovariance"](
                    new["geometry_msgs/msg/Twist"](ahead, zero), np.zeros(36)
                ),
            )
            writer.write(odometry, time_ns, store.serialize_ros1(message, ODOMETRY))
            if i % 50 == 0:
                text = new["std_msgs/msg/String"](data=f"word {i}")
                writer.write(words, time_ns, store.serialize_ros1(text, "std_msgs/msg/String"))
    return path


WAYS = [None, Ros1Writer.CompressionFormat.BZ2, Ros1Writer.CompressionFormat.LZ4]


@pytest.mark.parametrize("way", WAYS, ids=["plain", "bz2", "lz4"])
def test_a_bag_of_ros_1_is_read_as_one_of_ros_2(tmp_path, way):
    path = ros1_bag(tmp_path / "theirs.bag", way)
    opened = open_bag(path)
    assert opened.storage == "rosbag1"
    assert not opened.warnings
    assert counts(opened) == counts_by_rosbags(path)
    seen = odometries(opened.odometry())
    assert seen.stamp_ns.tolist() == [5 * NS + i * 20_000_000 for i in range(300)]
    assert seen.pose[:, 0] == pytest.approx(0.01 * np.arange(300))
    assert set(seen.child_frame) == {"base_footprint"}


def test_a_torn_bag_of_ros_1_is_read_up_to_the_tear(tmp_path):
    path = ros1_bag(tmp_path / "theirs.bag", None)
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    opened = open_bag(path)
    assert 100 < len(opened.odometry()) < 200
    assert "torn off" in opened.warnings[0]
    path.write_bytes(b"#ROSBAG V1.2\n")
    with pytest.raises(BagError, match=r"no bag of ROS 1, format 2\.0"):
        open_bag(path)


FORMS = [
    (StoragePlugin.MCAP, CompressionMode.NONE),
    (StoragePlugin.MCAP, CompressionMode.FILE),
    (StoragePlugin.MCAP, CompressionMode.MESSAGE),
    (StoragePlugin.SQLITE3, CompressionMode.NONE),
    (StoragePlugin.SQLITE3, CompressionMode.FILE),
    (StoragePlugin.SQLITE3, CompressionMode.MESSAGE),
]


@pytest.mark.parametrize(("storage", "compression"), FORMS)
def test_messages_that_stay_in_their_file_are_those_that_memory_would_hold(
    tmp_path, monkeypatch, storage, compression
):
    bag = write_foreign(tmp_path / "bag", storage, compression=compression)
    in_memory = open_bag(bag)
    assert counts(in_memory) == counts_by_rosbags(bag)
    monkeypatch.setattr("fulmar_bags.stored_bytes.KEPT_LENGTH", -1)
    in_file = open_bag(bag)
    for name, topic in in_memory.topics.items():
        assert in_file.topics[name].data == topic.data
        assert in_file.topics[name].data[-1] == topic.data[-1]
    assert (odometries(in_file.odometry()).pose == odometries(in_memory.odometry()).pose).all()


IMAGE = "std_msgs/msg/UInt8MultiArray"


def big_bag(path: Path, megabytes: int, *, compression: CompressionType, chunk: int = 4_000_000) -> Path:
    """Odometry, and a camera in the dark that makes most of the bag."""
    odometry = open_bag(write_foreign(path.with_suffix(""), StoragePlugin.MCAP)).odometry()
    new = type_store().types
    dark = new[IMAGE](new["std_msgs/msg/MultiArrayLayout"]([], 0), np.zeros(1_000_000, dtype=np.uint8))
    image = bytes(type_store().serialize_cdr(dark, IMAGE))
    with path.open("wb") as stream:
        writer = Writer(stream, compression=compression, chunk_size=chunk)
        writer.start(profile="ros2", library="tests")
        seen, camera = (
            writer.register_channel(
                topic, "cdr", writer.register_schema(kind, "ros2msg", message_type(kind).definition.encode())
            )
            for topic, kind in ((TOPIC, ODOMETRY), ("/camera", IMAGE))
        )
        for index in range(max(megabytes, len(odometry))):
            log_ns = odometry.log_ns[min(index, len(odometry) - 1)]
            if index < len(odometry):
                writer.add_message(seen, log_ns, odometry.data[index], log_ns)
            if index < megabytes:
                writer.add_message(camera, log_ns, image, log_ns)
        writer.finish()
    return path


MOST_MB = 500
ROBOT = ("--robot", "turtlebot2", "--task", "go_to_position")
COMMANDS = {
    "info": ("bag", "info"),
    "report": ("report", *ROBOT, "--force"),
    "plot": ("bag", "plot"),
    "csv": ("bag", "export", "--to", "csv"),
    "npz": ("bag", "export", "--to", "npz"),
    "identify": ("identify", "--robot", "turtlebot2"),
    "rerun": ("bag", "rerun", *ROBOT, "--goal", "0,0,0", "--controller", "classical"),
}


def memory_of(*words: object) -> tuple[float, str]:
    """Most memory of a command [MB], and what it printed."""
    program = (
        "import resource, subprocess, sys\n"
        "done = subprocess.run(sys.argv[1:], capture_output=True, text=True)\n"
        "print(done.stdout + done.stderr)\n"
        "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024)\n"
    )
    command = [sys.executable, "-c", program, sys.executable, "-m", "fulmar_cli.main", *map(str, words)]
    *printed, number = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    return float(number), "\n".join(printed)


@pytest.mark.parametrize("compression", [CompressionType.NONE, CompressionType.ZSTD])
def test_messages_that_are_not_asked_for_take_no_memory(tmp_path, compression):
    """The short twin of the bag of five gigabytes: in this process, by what is allocated."""
    path = big_bag(tmp_path / "bag.mcap", 60, compression=compression)
    tracemalloc.start()
    opened = open_bag(path)
    assert len(opened.topics["/camera"]) == 60
    assert len(odometries(opened.odometry())) == 200
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < 30e6


@pytest.mark.slow
@pytest.mark.parametrize("name", COMMANDS)
def test_a_bag_of_five_gigabytes_takes_less_than_half_of_one(big, name, tmp_path):
    megabytes, printed = memory_of(*COMMANDS[name], big)
    assert megabytes < MOST_MB, printed
    assert "Traceback" not in printed


@pytest.fixture(scope="session")
def big(tmp_path_factory):
    return big_bag(tmp_path_factory.mktemp("big") / "bag.mcap", 5000, compression=CompressionType.NONE)


@pytest.mark.slow
def test_a_chunk_that_is_larger_than_memory_is_unpacked_beside_it(tmp_path):
    path = big_bag(tmp_path / "bag.mcap", 700, compression=CompressionType.ZSTD, chunk=1 << 30)
    megabytes, printed = memory_of("bag", "info", path)
    assert megabytes < MOST_MB, printed


def test_a_log_without_a_whole_transaction_is_neither_read_nor_deleted(tmp_path):
    bag = written_in_wal(tmp_path / "bag", checkpointed=100, logged=100)
    (log,) = bag.glob("*-wal")
    content = bytearray(log.read_bytes())
    page = int.from_bytes(content[8:12], "big")
    log.write_bytes(content[: 32 + 24 + page])  # the first page of a transaction of several
    assert not any(content[36:40])
    before = {file.name: file.read_bytes() for file in bag.iterdir()}
    assert counts(open_bag(bag))[TOPIC] == 100
    gc.collect()  # closes the database
    assert {file.name: file.read_bytes() for file in bag.iterdir()} == before


def test_a_torn_database_is_read_with_its_log(tmp_path):
    bag = written_in_wal(tmp_path / "bag", checkpointed=100, logged=100)
    (file,) = bag.glob("*.db3")
    file.write_bytes(file.read_bytes()[:-1000])
    assert counts(open_bag(bag))[TOPIC] > 100


def test_a_database_whose_first_messages_are_damaged_gives_the_others(tmp_path):
    bag = write_foreign(tmp_path / "bag", StoragePlugin.SQLITE3, count=400)
    (file,) = bag.glob("*.db3")
    database = sqlite3.connect(file)
    (root,) = database.execute("SELECT rootpage FROM sqlite_schema WHERE name = 'messages'").fetchone()
    database.close()
    content = bytearray(file.read_bytes())
    page = int.from_bytes(content[16:18], "big")
    begin = (root - 1) * page
    assert content[begin] == 5  # a page of pages: its first cell has the number of the first leaf
    cell = begin + int.from_bytes(content[begin + 12 : begin + 14], "big")
    leaf = (int.from_bytes(content[cell : cell + 4], "big") - 1) * page
    content[leaf : leaf + page] = b"\xff" * page
    file.write_bytes(content)
    assert 380 < sum(counts(open_bag(bag)).values()) < 404


def test_messages_of_two_sources_in_turn_are_found_again():
    class One:
        def __init__(self, content: bytes) -> None:
            self.content = content

        def read(self, outer: int, at: int, length: int) -> bytes:
            return self.content

    sources, messages = (One(b"a"), One(b"b")), Payloads(Room(0))
    for number in range(70_000):
        messages.append(b" ", sources[number % 2], 0, number, 1)
    assert messages[69_998:] == [b"a", b"b"]


def test_many_large_chunks_need_one_file(tmp_path, monkeypatch):
    monkeypatch.setattr(mcap_records, "MOST_CHUNK", 1000)
    path = tmp_path / "large.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream, chunk_size=4000, compression=CompressionType.NONE)
        writer.start(profile="ros2", library="tests")
        schema = writer.register_schema("a/msg/A", "ros2msg", b"uint8[] data")
        channel = writer.register_channel("/large", "cdr", schema)
        for number in range(100):
            writer.add_message(channel, number, bytes([number]) * 5000, number)
        writer.finish()
    before = len(os.listdir("/proc/self/fd"))
    file = mcap_records.McapFile(path)
    damage: list[str] = []
    placed = [each for each in file.records(damage) if isinstance(each, mcap_records.PlacedMessage)]
    assert len(os.listdir("/proc/self/fd")) <= before + 1
    assert not damage
    assert [file.read(each.outer, each.at, 5000) for each in placed] == [each.data for each in placed]
    assert [each.data[0] for each in placed] == list(range(100))
