"""Damaged bags, and what is no bag: each is read as far as it goes; what is wrong is said without a traceback."""

from __future__ import annotations

import contextlib
import json
import random

import pytest
import yaml
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from rosbags.rosbag2.enums import CompressionMode, StoragePlugin

from fulmar_bags.contents import open_bag
from fulmar_bags.figures import describe
from fulmar_bags.message_types import type_store
from fulmar_bags.ring import FAULTS
from fulmar_bags.writer import BagWriter
from fulmar_core.config.errors import BagError, FulmarError
from fulmar_core.config.paths import config_path
from fulmar_core.robots.topics import ODOMETRY
from tests.foreign_bag import write_foreign
from tests.fulmar_cli.bag_commands import POLICY, answer, ask, file_of


def test_messages_that_a_damaged_file_has_lost_count_as_dropped(tmp_path):
    bag = BagWriter(tmp_path / "bag", run_info={})
    bag.add_topic("/words", "std_msgs/msg/String", "stream")
    sizes, draw, kind = [], random.Random(1), type_store().types["std_msgs/msg/String"]
    for _ in range(3):
        for _ in range(10):
            noise = kind(draw.randbytes(1000).hex())  # chunks much longer than the index behind them
            bag.write("/words", bytes(type_store().serialize_cdr(noise, "std_msgs/msg/String")), log_ns=1)
        bag.flush()
        sizes.append(bag.counts.size)
    bag.close()
    file = file_of(tmp_path / "bag")
    whole = bytearray(file.read_bytes())
    whole[(sizes[0] + sizes[1]) // 2] ^= 0xFF  # within the second chunk
    file.write_bytes(whole)
    found = describe(open_bag(tmp_path / "bag"))
    assert found["topics"][0]["count"] == 20
    assert found["topics"][0]["dropped"] == 10
    assert found["damage"]


@pytest.mark.parametrize("share", [0.2, 0.5, 0.8, 0.99])
def test_a_truncated_bag_is_read_up_to_the_cut_and_says_so(copy, share):
    whole = file_of(copy).read_bytes()
    file_of(copy).write_bytes(whole[: int(share * len(whole))])
    done = ask("info", copy)
    assert done.exit_code in (0, 1)
    assert done.exit_code == 0 or "damage:" in done.stdout


@settings(max_examples=6, deadline=None, suppress_health_check=list(HealthCheck))
@given(seed=st.integers(0, 2**32 - 1), flips=st.integers(1, 12))
@example(seed=114314, flips=11)  # ends an area where it begins
def test_flipped_bits_end_in_figures_or_in_one_clear_line(tmp_path_factory, seed, flips):
    rng = random.Random(seed)
    damaged = bytearray(file_of(POLICY).read_bytes())
    for _ in range(flips):
        damaged[rng.randrange(len(damaged))] ^= 1 << rng.randrange(8)
    file = tmp_path_factory.mktemp("flipped") / "bag_0.mcap"
    file.write_bytes(damaged)
    for words in (
        ["info", file],
        ["rerun", file],
        ["rerun", file, "--from", "odometry"],
        ["diff", file, POLICY],
    ):
        done = ask(*words)
        if done.exception is not None and not isinstance(done.exception, SystemExit):
            assert isinstance(done.exception, FulmarError), (words, seed, flips, done.exception)
            assert "\n" not in str(done.exception)
        else:
            assert done.exit_code in (0, 1)


@pytest.mark.parametrize(
    ("content", "reported"),
    [(b"", "the file is empty"), (b"not a bag at all", "no MCAP file"), (b"\x89MCAP", "no MCAP file")],
)
def test_an_empty_file_and_one_of_another_kind_are_refused(tmp_path, content, reported):
    file = tmp_path / "bag_0.mcap"
    file.write_bytes(content)
    with pytest.raises(BagError, match=reported) as refused:
        open_bag(tmp_path)
    assert str(file) in str(refused.value)
    assert "Give a bag folder" not in str(refused.value)


def test_what_is_not_there_is_refused(tmp_path):
    with pytest.raises(BagError, match="no such bag"):
        open_bag(tmp_path / "nothing")
    with pytest.raises(BagError, match=r"no \.mcap and no \.db3 file: it is empty"):
        open_bag(tmp_path)
    (tmp_path / "notes.txt").touch()
    with pytest.raises(BagError, match=r"no \.mcap and no \.db3 file, only notes\.txt"):
        open_bag(tmp_path)


def test_a_topic_under_a_wrong_schema_is_no_answer(tmp_path):
    bag = BagWriter(tmp_path / "bag", run_info={"robot": "floating_platform", "task": "go_to_pose"})
    bag.add_topic("/floating_platform/odom", "std_msgs/msg/String", "stream")
    bag.write("/floating_platform/odom", open_bag(POLICY).of(ODOMETRY).data[0], log_ns=1)
    bag.close()
    assert answer("info", tmp_path / "bag")["topics"][0]["type"] == "std_msgs/msg/String"
    done = ask("rerun", tmp_path / "bag", "--controller", "lqr")
    assert isinstance(done.exception, BagError)
    assert "holds no nav_msgs/msg/Odometry" in str(done.exception)


@pytest.mark.parametrize("garbage", [b"\x00\x01\x00\x00" + bytes(range(200)), b"", bytes(3), b"\xff" * 720])
def test_bytes_that_are_not_what_the_schema_says_are_counted_and_left_out(tmp_path, garbage):
    bag = BagWriter(tmp_path / "bag", run_info={"robot": "floating_platform", "task": "go_to_pose"})
    odometry = open_bag(POLICY).of(ODOMETRY)
    bag.add_topic(odometry.name, odometry.type, "stream")
    for index, data in enumerate(odometry.data):
        bag.write(odometry.name, data if index % 2 else garbage, log_ns=odometry.log_ns[index])
    bag.close()
    reported = (
        f"{(len(odometry) + 1) // 2} of {len(odometry)} messages of {odometry.name} are no {odometry.type}."
    )
    found = answer("info", tmp_path / "bag")
    assert found["damage"] == [reported]
    assert found["topics"][0]["rate_hz"] == pytest.approx(2.5)
    assert ask("info", tmp_path / "bag").exit_code == 1
    assert reported in ask("plot", tmp_path / "bag", "--out", tmp_path / "p.png").stderr


def test_where_no_message_is_what_the_schema_says_the_reason_is_reported(tmp_path):
    bag = BagWriter(tmp_path / "bag", run_info={"robot": "floating_platform", "task": "go_to_pose"})
    bag.add_topic("/floating_platform/odom", ODOMETRY.type, "stream")
    for index in range(20):
        bag.write("/floating_platform/odom", bytes([0, 1, 0, 0]) + bytes(range(200)), log_ns=index * 10**8)
    bag.close()
    (topic,) = answer("info", tmp_path / "bag")["topics"]
    assert (topic["count"], topic["rate_hz"], topic["late"]) == (20, None, None)
    for command in ("rerun", "plot"):
        assert "20 of 20 messages of /floating_platform/odom" in str(ask(command, tmp_path / "bag").exception)


def test_a_compressed_file_that_is_torn_is_read_up_to_the_tear(tmp_path):
    folder = write_foreign(tmp_path / "bag", StoragePlugin.MCAP, compression=CompressionMode.FILE)
    (file,) = folder.glob("*.zstd")
    file.write_bytes(file.read_bytes()[:-40])
    with contextlib.suppress(BagError):
        assert open_bag(folder).warnings
    file.write_bytes(b"garbage")
    with pytest.raises(BagError, match=r"bag_0|bag\.mcap"):
        open_bag(folder)


def test_a_flipped_bit_in_an_attachment_is_named_and_the_file_left_out(tmp_path):
    robot = config_path("robots", "floating_platform").read_bytes()
    BagWriter(
        tmp_path / "bag",
        run_info={"robot": "floating_platform"},
        attachments={"robot.yaml": robot, "notes.txt": b"whole"},
    ).close()
    file = file_of(tmp_path / "bag")
    data = bytearray(file.read_bytes())
    data[data.index(robot) + 10] ^= 1
    file.write_bytes(data)
    found = answer("info", tmp_path / "bag")
    (line,) = found["damage"]
    assert "the attached 'robot.yaml'" in line
    assert list(found["provenance"]["attachments"]) == ["notes.txt"]
    assert found["provenance"]["config_changed_since"] == []


def test_a_flipped_bit_in_the_run_record_is_named(tmp_path):
    BagWriter(tmp_path / "bag", run_info={"robot": "floating_platform", "seed": 7}).close()
    file = file_of(tmp_path / "bag")
    file.write_bytes(file.read_bytes().replace(b'"seed": 7', b'"seed": 3'))
    (line,) = answer("info", tmp_path / "bag")["damage"]
    assert "metadata.yaml differ" in line


def test_records_that_are_nested_too_deeply_state_nothing(tmp_path):
    BagWriter(tmp_path / "bag", run_info={"robot": "floating_platform"}).close()
    path = tmp_path / "bag" / "metadata.yaml"
    document = yaml.safe_load(path.read_text())
    custom = document["rosbag2_bagfile_information"]["custom_data"]
    assert custom
    custom.update(dict.fromkeys([*custom, FAULTS], "[" * 100_000))
    path.write_text(yaml.safe_dump(document))
    bag = open_bag(tmp_path / "bag")
    assert bag.faults == ()
    assert bag.info["robot"] == "floating_platform"  # the file itself has it too


def test_a_torn_bag_is_recovered_with_all_that_is_reported_about_it(tmp_path):
    bag = BagWriter(tmp_path / "bag", run_info={"robot": "floating_platform"})
    bag.add_topic("/words", "std_msgs/msg/String", "stream")
    data = bytes(
        type_store().serialize_cdr(type_store().types["std_msgs/msg/String"]("x"), "std_msgs/msg/String")
    )
    bag.note("fulmar_recording", json.dumps({"complete": False, "dropped": {"/words": 7}}))
    bag.write("/words", data, log_ns=1)
    bag.flush()
    file = file_of(tmp_path / "bag")
    file.write_bytes(file.read_bytes()[:-60])
    lost = answer("recover", tmp_path / "bag")["lost"]
    assert len(lost) == 1
    found = open_bag(tmp_path / "bag")
    assert (len(found.topics["/words"]), found.warnings) == (1, ())
    assert found.recording["dropped"] == {"/words": 7}
    again = ask("recover", tmp_path / "bag")
    assert (again.exit_code, "lost" in again.stdout) == (0, False)
    assert "Give the folder" in str(ask("recover", file).exception)


def test_a_missing_file_of_a_split_bag_is_named(tmp_path):
    bag = BagWriter(tmp_path / "bag", run_info={})
    bag.add_topic("/words", "std_msgs/msg/String", "stream")
    data = bytes(
        type_store().serialize_cdr(type_store().types["std_msgs/msg/String"]("x"), "std_msgs/msg/String")
    )
    for index in range(3):
        bag.write("/words", data, log_ns=index + 1)
        bag.split()
    bag.close()
    (tmp_path / "bag" / "bag_1.mcap").unlink()
    assert open_bag(tmp_path / "bag").warnings == (
        "bag_1.mcap: the file is missing; metadata.yaml lists it.",
    )
    assert ask("info", tmp_path / "bag").exit_code == 1


def test_a_damaged_sqlite3_bag_is_reported_in_one_line(tmp_path):
    bag = write_foreign(tmp_path / "bag", StoragePlugin.SQLITE3)
    file = next(bag.glob("*.db3"))
    whole = file.read_bytes()
    file.write_bytes(whole[: len(whole) // 3])
    try:
        assert open_bag(bag).warnings
    except BagError as error:
        assert "\n" not in str(error)
