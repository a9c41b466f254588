"""A bag is readable by everybody, at every moment of its life."""

from __future__ import annotations

import json
import resource
import signal
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from mcap.reader import NonSeekingReader, make_reader
from mcap.records import Channel, DataEnd, Schema
from mcap.stream_reader import StreamReader
from mcap.writer import Writer
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import Reader

from fulmar_bags.contents import open_bag as open_recorded
from fulmar_bags.message_types import type_store
from fulmar_bags.metadata import read_information
from fulmar_bags.recovery import recover
from fulmar_bags.writer import BagWriter
from fulmar_bags.writer_thread import BagThread
from fulmar_core.config.errors import BagError
from tests.fulmar_bags.bags import publish_times

TOPIC, TYPE = "/robot/word", "std_msgs/msg/String"
INFO = {"robot": "floating_platform", "goal": [0.0, 1.0, 90.0]}
START_NS = 1_700_000_000_000_000_000


def word(text: str) -> bytes:
    return bytes(type_store().serialize_cdr(type_store().types[TYPE](text), TYPE))


def open_bag(folder: Path, **options: object) -> BagWriter:
    bag = BagWriter(folder, run_info=INFO, **options)
    bag.add_topic(TOPIC, TYPE, "latched")
    return bag


def write_words(bag: BagWriter, first: int, count: int) -> None:
    for number in range(first, first + count):
        bag.write(TOPIC, word(f"word {number}"), log_ns=START_NS + number * 10_000_000)


def file_of(folder: Path) -> Path:
    return next(folder.glob("*.mcap"))


def words_by_rosbags(folder: Path) -> list[str]:
    with AnyReader([folder]) as reader:
        return [reader.deserialize(raw, c.msgtype).data for c, _, raw in reader.messages()]


def words_by_mcap(folder: Path, reader_class: object = make_reader) -> list[str]:
    with file_of(folder).open("rb") as stream:
        reader = reader_class(stream, decoder_factories=[DecoderFactory()])
        return [message.data for *_, message in reader.iter_decoded_messages()]


def assert_readable(folder: Path, count: int) -> None:
    expected = [f"word {number}" for number in range(count)]
    assert words_by_rosbags(folder) == expected
    assert words_by_mcap(folder) == expected
    assert words_by_mcap(folder, NonSeekingReader) == expected


def test_a_bag_is_whole_from_its_first_moment_to_its_last(tmp_path):
    folder = tmp_path / "bag"
    bag = open_bag(folder)
    assert_readable(folder, 0)
    write_words(bag, 0, 100)
    bag.flush()
    assert_readable(folder, 100)
    write_words(bag, 100, 50)
    assert_readable(folder, 100)
    bag.close()
    assert_readable(folder, 150)


def test_a_bag_whose_recorder_died_before_the_first_message_opens_with_its_types(tmp_path):
    bag = open_bag(tmp_path / "bag")
    bag.flush()
    with AnyReader([tmp_path / "bag"]) as reader:
        assert [(c.topic, c.msgtype) for c in reader.connections] == [(TOPIC, TYPE)]
    with file_of(tmp_path / "bag").open("rb") as stream:
        assert list(make_reader(stream).iter_messages()) == []


def test_metadata_counts_what_is_in_the_bag_after_each_flush(tmp_path):
    folder = tmp_path / "bag"
    bag = open_bag(folder)
    write_words(bag, 0, 7)
    bag.flush()
    with Reader(folder) as reader:
        assert reader.message_count == 7
        assert reader.duration == 60_000_001
        assert reader.start_time == START_NS
        (connection,) = reader.connections
    assert connection.digest.startswith("RIHS01_")
    written = yaml.safe_load((folder / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert written["version"] == 9
    assert written["ros_distro"] == "jazzy"
    assert json.loads(written["custom_data"]["fulmar"]) == INFO
    bag.close()


def test_ticks_flush_twice_a_second(tmp_path):
    folder = tmp_path / "bag"
    bag = open_bag(folder)
    bag.tick(10.0)
    write_words(bag, 0, 3)
    bag.tick(10.4)
    assert words_by_mcap(folder) == []
    bag.tick(10.5)
    assert len(words_by_mcap(folder)) == 3


def test_run_information_and_attachments_travel_in_the_file(tmp_path):
    bag = open_bag(tmp_path / "bag", attachments={"robot.yaml": b"name: it\n"})
    bag.close()
    with file_of(tmp_path / "bag").open("rb") as stream:
        reader = make_reader(stream)
        (metadata,) = reader.iter_metadata()
        (attachment,) = reader.iter_attachments()
    assert metadata.name == "fulmar"
    assert json.loads(metadata.metadata["run"]) == INFO
    assert (attachment.name, attachment.data) == ("robot.yaml", b"name: it\n")


def test_log_times_never_go_backwards(tmp_path):
    bag = open_bag(tmp_path / "bag")
    for log_ns in (START_NS, START_NS - 5, START_NS + 1):
        bag.write(TOPIC, word("x"), log_ns=log_ns)
    bag.close()
    with Reader(tmp_path / "bag") as reader:
        assert [time for _, time, _ in reader.messages(reader.connections)] == [
            START_NS,
            START_NS,
            START_NS + 1,
        ]


def test_a_bag_keeps_when_a_message_was_sent_and_says_when_it_was_received_where_that_is_unknown(tmp_path):
    bag = open_bag(tmp_path / "bag")
    for number, sent_ns in enumerate((START_NS - 7, None, 0)):
        bag.write(TOPIC, word(f"word {number}"), log_ns=START_NS, publish_ns=sent_ns)
    bag.close()
    sent = publish_times(tmp_path / "bag")
    assert sent == {"word 0": START_NS - 7, "word 1": START_NS, "word 2": START_NS}
    assert list(open_recorded(tmp_path / "bag").topics[TOPIC].publish_ns) == list(sent.values())


def test_the_thread_passes_on_when_a_message_was_sent(tmp_path):
    thread = BagThread(open_bag(tmp_path / "bag"), on_error=print)
    thread.put(TOPIC, word("word 0"), START_NS, START_NS - 7)
    thread.stop()
    assert publish_times(tmp_path / "bag") == {"word 0": START_NS - 7}


def test_an_existing_bag_is_not_overwritten(tmp_path):
    open_bag(tmp_path / "bag").close()
    before = file_of(tmp_path / "bag").read_bytes()
    with pytest.raises(BagError, match="never overwritten"):
        open_bag(tmp_path / "bag")
    assert file_of(tmp_path / "bag").read_bytes() == before


def test_an_unknown_message_type_is_named(tmp_path):
    with pytest.raises(BagError, match="my_msgs/msg/Mine"):
        BagWriter(tmp_path / "bag", run_info={}).add_topic("/x", "my_msgs/msg/Mine", "stream")


def test_a_killed_writer_leaves_everything_up_to_its_last_flush(tmp_path):
    folder = tmp_path / "bag"
    program = f"""
import os, signal, sys
from pathlib import Path
sys.path.insert(0, {str(Path(__file__).parents[2])!r})
from tests.fulmar_bags.test_writer import open_bag, write_words
bag = open_bag(Path({str(folder)!r}))
write_words(bag, 0, 500)
bag.flush()
write_words(bag, 500, 20)
os.kill(os.getpid(), signal.SIGKILL)
"""
    child = subprocess.run([sys.executable, "-c", program], timeout=60)
    assert child.returncode == -signal.SIGKILL
    assert_readable(folder, 500)
    with Reader(folder) as reader:
        assert reader.message_count == 500


@pytest.fixture
def small_disk():
    """Let files grow to 40 kB at most: Python sees an OSError, as it does when a disk is full."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    old = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (40_000, before[1]))
    yield lambda: resource.setrlimit(resource.RLIMIT_FSIZE, before)
    resource.setrlimit(resource.RLIMIT_FSIZE, before)
    signal.signal(signal.SIGXFSZ, old)


def noise(number: int) -> bytes:
    """A message that does not compress."""
    import random

    return word(random.Random(number).randbytes(1000).hex())


def test_a_full_disk_keeps_what_it_took_and_takes_the_rest_later(tmp_path, small_disk):
    bag = open_bag(tmp_path / "bag")
    bag.write(TOPIC, word("word 0"), log_ns=START_NS)
    bag.flush()
    for number in range(100):
        bag.write(TOPIC, noise(number), log_ns=START_NS)
    with pytest.raises(OSError, match="too large"):
        bag.flush()
    assert bag.counts.on_disk == 1
    assert_readable(tmp_path / "bag", 1)
    small_disk()
    bag.close()
    assert len(words_by_rosbags(tmp_path / "bag")) == 101


def test_a_full_disk_is_reported_once_and_the_thread_goes_on(tmp_path, small_disk):
    reported = []
    bag = open_bag(tmp_path / "bag")
    thread = BagThread(bag, on_error=reported.append)
    for number in range(100):
        thread.put(TOPIC, noise(number), START_NS)
    outcome = thread.stop()
    assert outcome.received == 100
    assert outcome.lost == 100
    assert len(reported) == 1
    assert "too large" in reported[0]
    assert_readable(tmp_path / "bag", 0)


def test_a_full_queue_drops_and_counts(tmp_path):
    reported = []
    thread = BagThread(open_bag(tmp_path / "bag"), on_error=reported.append, max_queued=10)
    for number in range(5000):
        thread.put(TOPIC, word(f"word {number}"), START_NS + number)
    outcome = thread.stop()
    assert outcome.received == 5000
    assert 0 < outcome.lost < 5000
    assert outcome.recorded == len(words_by_rosbags(tmp_path / "bag"))
    assert len(reported) == 1


def test_recovery_rewrites_a_torn_bag_and_keeps_the_torn_file(tmp_path):
    folder = tmp_path / "bag"
    bag = open_bag(folder, attachments={"a": b"b"})
    write_words(bag, 0, 100)
    bag.flush()
    whole = bag.counts.size
    write_words(bag, 100, 100)
    bag.flush()
    torn = file_of(folder).read_bytes()[: whole + 100]
    file_of(folder).write_bytes(torn)

    damage = recover(folder)

    assert len(damage) == 1
    assert_readable(folder, 100)
    with Reader(folder) as reader:
        assert reader.message_count == 100
    assert next(folder.glob("*.damaged")).read_bytes() == torn
    with file_of(folder).open("rb") as stream:
        assert [a.name for a in make_reader(stream).iter_attachments()] == ["a"]


def test_recovery_of_a_whole_bag_changes_no_message(tmp_path):
    bag = open_bag(tmp_path / "bag")
    write_words(bag, 0, 100)
    bag.close()
    assert recover(tmp_path / "bag") == ()
    assert_readable(tmp_path / "bag", 100)
    assert len(list((tmp_path / "bag").iterdir())) == 2


@pytest.mark.parametrize(
    ("qos", "reported"),
    [
        ("[" * 50_000, "nested too deeply"),
        ("[1", "expected ','"),
        ("!!timestamp x", "not what its tag says"),
        ("5", "it is no list"),
    ],
)
def test_recovery_states_of_a_quality_of_service_that_cannot_be_read(tmp_path, qos, reported):
    path = tmp_path / "bag" / "bag_0.mcap"
    path.parent.mkdir()
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start(profile="ros2", library="test")
        schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data")
        channel = writer.register_channel("/words", "cdr", schema, {"offered_qos_profiles": qos})
        writer.add_message(channel, 1, b"\0\1\0\0\2\0\0\0a\0", 1)
        writer.finish()
    (damage,) = recover(tmp_path / "bag")
    assert damage.startswith(f"{path}: the QoS of /words cannot be read: ")
    assert reported in damage
    with Reader(tmp_path / "bag") as reader:
        assert reader.message_count == 1


@pytest.mark.parametrize(
    "text",
    [
        "[" * 100_000,
        "- " * 100_000,
        "rosbag2_bagfile_information: [1",
        "rosbag2_bagfile_information: {version: !!timestamp x}",
        'rosbag2_bagfile_information: {version: !!int ""}',
        "- 1",
    ],
)
def test_metadata_that_cannot_be_read_states_nothing(tmp_path, text):
    (tmp_path / "metadata.yaml").write_text(text)
    assert read_information(tmp_path) == {}


def definitions_in(path: Path) -> list[tuple[type, int]]:
    """Kind and number of each definition in the data of a file, chunks unpacked, in the order of the file."""
    found = []
    with path.open("rb") as stream:
        for record in StreamReader(stream).records:
            if isinstance(record, DataEnd):  # the summary after it repeats them all
                break
            if isinstance(record, Schema | Channel):
                found.append((type(record), record.id))
    return found


@pytest.mark.parametrize("finished", [True, False])
def test_each_definition_stands_once_whenever_its_topic_is_announced(tmp_path, finished):
    bag = open_bag(tmp_path / "bag")
    bag.add_topic("/robot/silent", "nav_msgs/msg/Odometry", "sensor")
    write_words(bag, 0, 3)
    bag.add_topic("/robot/late", "geometry_msgs/msg/Twist", "latched")  # into a chunk that has messages
    bag.flush()
    bag.add_topic("/robot/later", TYPE, "latched")
    bag.flush()
    write_words(bag, 3, 3)
    bag.close() if finished else bag.flush()
    found = definitions_in(file_of(tmp_path / "bag"))
    assert len(found) == len(set(found)) == 3 + 4
    with file_of(tmp_path / "bag").open("rb") as stream:
        topics = {record.topic for record in StreamReader(stream).records if isinstance(record, Channel)}
    assert topics == {TOPIC, "/robot/silent", "/robot/late", "/robot/later"}
    assert words_by_mcap(tmp_path / "bag") == [f"word {number}" for number in range(6)]


def test_a_recovered_file_has_each_definition_once_too(tmp_path):
    bag = open_bag(tmp_path / "bag")
    write_words(bag, 0, 3)
    bag.flush()
    recover(tmp_path / "bag")
    found = definitions_in(file_of(tmp_path / "bag"))
    assert len(found) == len(set(found)) == 2
