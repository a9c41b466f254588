"""`fulmar bag`: every bag is read as far as it goes, whoever recorded it; what is wrong is said without a traceback."""

from __future__ import annotations

import contextlib
import csv
import itertools
import json
import random
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from rosbags.rosbag2.enums import CompressionMode, StoragePlugin
from typer.testing import CliRunner

from fulmar_bringup.bag_reader import read_run
from fulmar_bringup.bags.contents import open_bag
from fulmar_bringup.bags.decode import joint_vectors, messages, odometries, stamp_of, stamps_ns
from fulmar_bringup.bags.figures import describe
from fulmar_bringup.bags.pictures import _drawings
from fulmar_bringup.cli import app
from fulmar_bringup.report.actuator_picture import open_spans
from fulmar_bringup.run_judgement import judge
from fulmar_core.errors import BagError, FulmarError
from fulmar_core.paths import config_path
from fulmar_core.topics import ACTION, ODOMETRY
from fulmar_ros.bag_ring import FAULTS
from fulmar_ros.bag_types import type_store
from fulmar_ros.bag_writer import BagWriter
from tests.fulmar_bringup.foreign_bag import write_foreign

BAGS = Path(__file__).resolve().parents[1] / "replay" / "bags"
POLICY, LQR = BAGS / "floating_platform_go_to_pose_policy", BAGS / "floating_platform_go_to_pose_lqr"
STORAGES = [StoragePlugin.MCAP, StoragePlugin.SQLITE3]


def ask(*words: object):
    return CliRunner().invoke(app, ["bag", *map(str, words)])


def answer(*words: object) -> dict:
    done = ask(*words, "--json")
    assert done.exception is None or isinstance(done.exception, SystemExit), done.exception
    return json.loads(done.stdout[done.stdout.index("{") :])


def file_of(bag: Path) -> Path:
    return next(bag.glob("*.mcap"))


def test_info_tells_what_the_recorder_dropped_and_which_packages_it_ran_with(tmp_path):
    bag = BagWriter(
        tmp_path / "bag",
        run_info={"robot": "floating_platform"},
        attachments={
            "provenance.json": b'{"python": "3.12.1", "platform": "Linux"}',
            "uncommitted.patch": b"--- a",
        },
    )
    bag.add_topic("/floating_platform/odom", "nav_msgs/msg/Odometry", "stream")
    bag.write("/floating_platform/odom", bytes(100), log_ns=1)
    bag.note("fulmar_recording", json.dumps({"complete": False, "dropped": {"/floating_platform/odom": 7}}))
    bag.close()
    found = describe(open_bag(tmp_path / "bag"))
    assert found["topics"][0]["dropped"] == 7
    assert found["provenance"]["made_by"]["python"] == "3.12.1"
    assert found["provenance"]["uncommitted_changes"] is True
    assert found["provenance"]["recorded_to_its_end"] is False
    assert "did not come to an orderly end" in ask("info", tmp_path / "bag").stdout


@pytest.fixture
def copy(tmp_path) -> Path:
    return Path(shutil.copytree(POLICY, tmp_path / "bag"))


def test_info_tells_counts_rates_and_where_a_bag_comes_from():
    found = answer("info", POLICY)
    topics = {topic["name"]: topic for topic in found["topics"]}
    action = topics["/floating_platform/controller/action"]
    assert action["count"] == 100
    assert action["rate_hz"] == pytest.approx(5.0)
    assert action["gaps"] == 0
    assert action["dropped"] == 0
    assert found["provenance"]["robot"] == "floating_platform"
    assert found["provenance"]["controller"] == "policy"
    assert len(found["provenance"]["controller_sha256"]) == 64
    assert found["damage"] == []
    assert ask("info", POLICY).exit_code == 0


def test_info_names_configuration_that_has_changed_since(tmp_path):
    bag = BagWriter(
        tmp_path / "bag",
        run_info={"robot": "floating_platform", "task": "go_to_pose"},
        attachments={"robot.yaml": b"name: another\n"},
    )
    bag.close()
    found = describe(open_bag(tmp_path / "bag"))
    assert found["provenance"]["config_changed_since"] == ["robots/floating_platform.yaml"]


def test_info_counts_gaps_late_and_dropped_messages(tmp_path):
    bag = BagWriter(tmp_path / "bag", run_info={"robot": "floating_platform"})
    bag.add_topic("/floating_platform/odom", ODOMETRY.type, "stream")
    source = open_bag(POLICY).of(ODOMETRY)
    stamps = stamps_ns(source)
    for index, data in enumerate(source.data):
        if 10 <= index < 14:
            continue  # a gap of a second, which is five periods
        late = 500_000_000 if index == 50 else 0
        bag.write(
            "/floating_platform/odom", data, log_ns=1_700_000_000_000_000_000 + int(stamps[index]) + late
        )
    bag.close()
    (topic,) = describe(open_bag(tmp_path / "bag"))["topics"]
    assert topic["gaps"] == 1
    assert topic["longest_gap_s"] == pytest.approx(1.0)
    assert topic["late"] >= 1
    assert topic["delay_ms"]["max"] >= 400.0


def test_messages_that_a_damaged_file_has_lost_count_as_dropped(tmp_path):
    bag = BagWriter(tmp_path / "bag", run_info={})
    bag.add_topic("/words", "std_msgs/msg/String", "stream")
    sizes, draw, kind = [], random.Random(1), type_store().types["std_msgs/msg/String"]
    for _ in range(3):
        for _ in range(10):
            noise = kind(draw.randbytes(1000).hex())  # chunks much longer than the index behind them
            bag.write("/words", bytes(type_store().serialize_cdr(noise, "std_msgs/msg/String")), log_ns=1)
        bag.flush()
        sizes.append(bag.size)
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


@settings(max_examples=12, deadline=None, suppress_health_check=list(HealthCheck))
@given(seed=st.integers(0, 2**32 - 1), flips=st.integers(1, 12))
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
    ("content", "told"),
    [(b"", "the file is empty"), (b"not a bag at all", "no MCAP file"), (b"\x89MCAP", "no MCAP file")],
)
def test_an_empty_file_and_one_of_another_kind_are_refused(tmp_path, content, told):
    file = tmp_path / "bag_0.mcap"
    file.write_bytes(content)
    with pytest.raises(BagError, match=told) as refused:
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
    told = (
        f"{(len(odometry) + 1) // 2} of {len(odometry)} messages of {odometry.name} are no {odometry.type}."
    )
    found = answer("info", tmp_path / "bag")
    assert found["damage"] == [told]
    assert found["topics"][0]["rate_hz"] == pytest.approx(2.5)
    assert ask("info", tmp_path / "bag").exit_code == 1
    assert told in ask("plot", tmp_path / "bag", "--out", tmp_path / "p.png").stderr


def test_where_no_message_is_what_the_schema_says_the_reason_is_told(tmp_path):
    bag = BagWriter(tmp_path / "bag", run_info={"robot": "floating_platform", "task": "go_to_pose"})
    bag.add_topic("/floating_platform/odom", ODOMETRY.type, "stream")
    for index in range(20):
        bag.write("/floating_platform/odom", bytes([0, 1, 0, 0]) + bytes(range(200)), log_ns=index * 10**8)
    bag.close()
    (topic,) = answer("info", tmp_path / "bag")["topics"]
    assert (topic["count"], topic["rate_hz"], topic["late"]) == (20, None, None)
    for command in ("rerun", "plot"):
        assert "20 of 20 messages of /floating_platform/odom" in str(ask(command, tmp_path / "bag").exception)


def test_every_message_of_the_reference_bags_is_what_its_schema_says():
    for folder in BAGS.iterdir():
        assert not [topic.name for topic in open_bag(folder).topics.values() if topic.unreadable]


def test_a_bag_without_messages_is_told(tmp_path):
    BagWriter(tmp_path / "bag", run_info={"robot": "floating_platform"}).close()
    assert answer("info", tmp_path / "bag")["messages"] == 0


def test_a_bag_in_several_files_is_one_bag(tmp_path):
    shutil.copy(file_of(POLICY), tmp_path / "bag_0.mcap")
    shutil.copy(file_of(POLICY), tmp_path / "bag_1.mcap")
    assert len(open_bag(tmp_path).of(ACTION)) == 200


def test_arrays_at_once_are_what_message_by_message_gives():
    bag = open_bag(POLICY)
    fast = joint_vectors(bag.of(ACTION), "effort")
    slow = messages(bag.of(ACTION))
    assert fast.names == tuple(slow[0][1].name)
    np.testing.assert_array_equal(fast.values, [m.effort for _, m in slow])
    np.testing.assert_array_equal(fast.stamp_ns, [stamp_of(m) for _, m in slow])
    seen, each = odometries(bag.of(ODOMETRY)), messages(bag.of(ODOMETRY))
    np.testing.assert_array_equal(seen.pose[:, 1], [m.pose.pose.position.y for _, m in each])
    np.testing.assert_array_equal(seen.pose[:, 6], [m.pose.pose.orientation.w for _, m in each])
    np.testing.assert_array_equal(seen.twist[:, 5], [m.twist.twist.angular.z for _, m in each])
    assert seen.frame[0] == "odom"


def test_a_message_with_other_names_goes_the_slow_way_and_is_left_out():
    topic = open_bag(POLICY).of(ACTION)
    topic.data[3] = topic.data[3].replace(b"thruster_1", b"thruster_9", 1)
    found = joint_vectors(topic, "effort")
    assert found.left_out == 1
    assert len(found) == len(topic) - 1


@pytest.mark.parametrize("storage", STORAGES)
def test_a_bag_that_others_recorded_loads_in_info_plot_and_rerun(tmp_path, storage):
    bag = write_foreign(tmp_path / "bag", storage)
    found = answer("info", bag)
    odometry = next(topic for topic in found["topics"] if topic["name"] == "/base/odometry")
    assert odometry["count"] == 200
    assert odometry["rate_hz"] == pytest.approx(50.0)
    assert not found["provenance"]["recorded_by_fulmar"]
    files = answer("plot", bag, "--out", tmp_path / "p.html", "--out", tmp_path / "p.png")["files"]
    page = Path(files[0]).read_text()
    assert "<svg" in page
    assert not re.search(r'(src|href|url\()[="\']*https?:', page.replace("xlink:href", "href"))
    assert Path(files[1]).read_bytes().startswith(b"\x89PNG")
    asked = ("--robot", "turtlebot2", "--task", "go_to_position", "--goal", "0,0,0")
    done = answer("rerun", bag, "--controller", "policy", *asked)
    assert not done["compared"]
    assert done["asked"] == done["steps"] > 30
    assert ask("rerun", bag, "--controller", "policy", *asked).exit_code == 1


@pytest.mark.parametrize(
    ("storage", "mode"),
    [
        *itertools.product(STORAGES, (CompressionMode.FILE, CompressionMode.MESSAGE)),
        (StoragePlugin.MCAP, CompressionMode.STORAGE),
    ],
)
def test_a_compressed_bag_is_the_same_as_a_plain_one(tmp_path, storage, mode):
    plain = open_bag(write_foreign(tmp_path / "plain", storage))
    packed = open_bag(write_foreign(tmp_path / "packed", storage, compression=mode))
    assert packed.warnings == ()
    assert packed.storage == plain.storage
    assert packed.topics == plain.topics
    assert open_bag(packed.files[0]).topics == plain.topics


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


def test_a_torn_bag_is_recovered_with_all_that_is_told_about_it(tmp_path):
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


@pytest.mark.parametrize("closed", [True, False], ids=["closed", "killed"])
def test_info_tells_when_and_why_a_ring_was_written(tmp_path, closed):
    bag = BagWriter(tmp_path / "bag", run_info={"robot": "floating_platform"})
    fault = {"time_ns": 1_700_000_000_000_000_000, "reason": "plant: the watchdog tripped"}
    bag.note(FAULTS, json.dumps([fault]))
    if closed:
        bag.close()
        (tmp_path / "bag" / "metadata.yaml").unlink()
    else:
        bag.flush()
    assert answer("info", tmp_path / "bag")["faults"] == [fault]
    assert re.search(
        r"written for a fault at 2023-11-1\d .*: plant: the watchdog tripped",
        ask("info", tmp_path / "bag").stdout,
    )


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


def test_odometry_whose_stamps_stay_zero_is_run_again_by_the_times_of_recording(tmp_path):
    asked = ("--controller", "policy", "--robot", "turtlebot2", "--task", "go_to_position", "--goal", "0,0,0")
    stamped = answer("rerun", write_foreign(tmp_path / "stamped", StoragePlugin.MCAP), *asked)
    done = answer("rerun", write_foreign(tmp_path / "bag", StoragePlugin.MCAP, stamped=False), *asked)
    assert done["asked"] == done["steps"] == stamped["steps"]
    assert any("do not advance" in warning for warning in done["warnings"])


def test_a_foreign_bag_without_a_goal_or_a_robot_says_what_to_give(tmp_path):
    bag = write_foreign(tmp_path / "bag", StoragePlugin.SQLITE3, count=5)
    assert "--robot" in str(ask("rerun", bag, "--controller", "lqr").exception)
    named = ask("rerun", bag, "--controller", "lqr", "--robot", "floating_platform", "--task", "go_to_pose")
    assert "goal" in named.stderr + named.stdout + str(named.exception)


def test_a_damaged_sqlite3_bag_is_told_in_one_line(tmp_path):
    bag = write_foreign(tmp_path / "bag", StoragePlugin.SQLITE3)
    file = next(bag.glob("*.db3"))
    whole = file.read_bytes()
    file.write_bytes(whole[: len(whole) // 3])
    try:
        assert open_bag(bag).warnings
    except BagError as error:
        assert "\n" not in str(error)


def test_a_bag_is_the_same_as_itself_and_differs_from_another():
    assert answer("diff", POLICY, POLICY)["same"]
    assert ask("diff", POLICY, POLICY).exit_code == 0
    found = answer("diff", POLICY, LQR)
    assert not found["same"]
    assert found["provenance"]["controller"] == ["policy", "lqr"]
    assert ask("diff", POLICY, LQR).exit_code == 1


def test_a_diff_names_the_field_and_the_time_of_the_first_difference(copy, tmp_path):
    bag = open_bag(copy)
    topic = bag.of(ODOMETRY)
    (log, message) = messages(topic)[7]
    message.pose.pose.position.x += 0.25
    out = BagWriter(tmp_path / "changed", run_info=bag.info)
    for each in bag.topics.values():
        out.add_topic(each.name, each.type, "stream")
    for each in bag.topics.values():
        for index, data in enumerate(each.data):
            changed = type_store().serialize_cdr(message, each.type) if each is topic and index == 7 else data
            out.write(each.name, bytes(changed), log_ns=each.log_ns[index])
    out.close()
    found = answer("diff", copy, tmp_path / "changed")
    (field,) = [f for t in found["topics"] if t["topic"] == "odom" for f in t["fields"]]
    assert field["name"] == "pose.pose.position.x"
    assert field["first_stamp_s"] == pytest.approx(stamp_of(message) / 1e9)
    assert field["found"] - field["recorded"] == pytest.approx(0.25)
    assert log == topic.log_ns[7]
    assert answer("diff", copy, tmp_path / "changed", "--tolerance", "0.3")["same"]


def test_tables_hold_every_number(tmp_path):
    answer("export", POLICY, "--to", "csv", "--out", tmp_path / "csv")
    with (tmp_path / "csv" / "floating_platform.odom.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    seen = odometries(open_bag(POLICY).of(ODOMETRY))
    assert [float(row["pose.pose.position.x"]) for row in rows] == seen.pose[:, 0].tolist()
    answer("export", POLICY, "--to", "npz", "--out", tmp_path / "bag.npz")
    arrays = np.load(tmp_path / "bag.npz", allow_pickle=False)
    np.testing.assert_array_equal(arrays["floating_platform/odom/pose.pose.position.x"], seen.pose[:, 0])
    np.testing.assert_array_equal(arrays["floating_platform/odom/stamp_ns"], seen.stamp_ns)


def test_a_dataset_holds_an_episode_for_each_bag_and_a_frame_for_each_step(tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    answer("export", POLICY, POLICY, "--to", "lerobot", "--out", tmp_path / "set")
    info = json.loads((tmp_path / "set/meta/info.json").read_text())
    assert info["codebase_version"] == "v2.1"
    assert (info["total_episodes"], info["total_frames"], info["fps"]) == (2, 200, 5)
    path = info["data_path"].format(episode_chunk=0, episode_index=1)
    table = parquet.read_table(tmp_path / "set" / path)
    assert set(table.column_names) == set(info["features"])
    recorded = joint_vectors(open_bag(POLICY).of(ACTION), "effort").values
    np.testing.assert_array_equal(np.array(table["action"].to_pylist()), recorded)
    assert table["index"].to_pylist() == list(range(100, 200))
    assert table["next.done"].to_pylist() == [False] * 99 + [True]
    lines = (tmp_path / "set/meta/episodes.jsonl").read_text().splitlines()
    assert [json.loads(line)["length"] for line in lines] == [100, 100]
    refused = ask(
        "export",
        POLICY,
        BAGS / "turtlebot2_go_to_position_policy",
        "--to",
        "lerobot",
        "--out",
        tmp_path / "mixed",
    )
    assert "another kind" in str(refused.exception)


def test_a_picture_of_another_kind_is_refused_as_what_it_is(tmp_path):
    refused = str(ask("plot", POLICY, "--out", tmp_path / "run.pdf").exception)
    assert "'.pdf' cannot be drawn" in refused
    assert "report" not in refused.split(": ", 1)[1]


def test_a_run_is_plotted_with_its_goal(tmp_path):
    (file,) = answer("plot", POLICY, "--out", tmp_path / "run.html")["files"]
    assert "How far from the goal" in Path(file).read_text()


@pytest.mark.parametrize("name", ["floating_platform_go_to_pose_policy", "turtlebot2_go_to_position_policy"])
def test_a_bag_without_what_was_applied_is_plotted_with_what_was_commanded(name):
    record = read_run(BAGS / name)
    assert not len(record.applied)
    np.testing.assert_array_equal(record.actuation.effort, record.commanded.effort)
    assert judge(record).run.shares.any()
    assert any(open_spans(record, row) for row in range(len(record.actuation.names)))


def test_panels_of_commands_are_told_apart_by_their_topics(tmp_path):
    bag = open_bag(POLICY)
    drawings = _drawings(bag, odometries(bag.of(ODOMETRY)))
    titles = [drawing.title for drawing in drawings if "actuators" in drawing.title]
    assert len(titles) == len(set(titles)) > 1
