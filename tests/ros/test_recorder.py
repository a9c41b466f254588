"""The recorder as a process of its own: what it keeps, what it says, and how it ends."""

from __future__ import annotations

import json
import os
import resource
import signal
import statistics
import subprocess
import sys
import threading
import time
from importlib.metadata import version

import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseStamped
from mcap.reader import make_reader
from nav_msgs.msg import Odometry
from rclpy.duration import Duration
from rosbags.rosbag2 import Reader
from std_msgs.msg import String

from fulmar_bags.contents import open_bag
from fulmar_core.config.errors import LockstepError
from fulmar_core.robots.topics import GOAL_POSE, METADATA
from fulmar_ros.qos import publish_patiently, publisher_qos
from tests.ros.recorder import ROBOT, odometry, publish, wait_for

real_time = pytest.mark.real_time


def test_a_stopped_recorder_has_kept_every_message_and_said_so_each_second_and_leaves_no_process(
    record, node, healths
):
    early = node.create_publisher(String, METADATA.name, publisher_qos(METADATA))
    early.publish(String(data="early"))
    latched = node.create_publisher(PoseStamped, GOAL_POSE.name, publisher_qos(GOAL_POSE))
    latched.publish(PoseStamped())
    volatile = node.create_publisher(PoseStamped, GOAL_POSE.name, 10)
    recorder = record("run_info:='{\"seed\": 7}'")
    recorder.wait_until_recording()
    while not early.get_subscription_count():  # endpoints find each other in any order
        time.sleep(0.01)
    # Whatever the machine holds the recorder up for: a publisher in real time keeps 50 messages, 0.1 s of these.
    publish(odometry(node, lockstep=True), range(500))
    for goals in (latched, volatile):
        assert goals.get_subscription_count()
        goals.publish(PoseStamped())
    for sent in (early, latched, volatile):
        assert sent.wait_for_all_acked(Duration(seconds=5.0))
    wait_for(lambda: healths and int(values(healths[-1])["recorded"]) >= 500)
    assert healths[-1].level == DiagnosticStatus.OK
    assert (values(healths[-1])["mode"], values(healths[-1])["dropped"]) == ("recording", "0")
    assert int(values(healths[-1])["free_bytes"]) > 0
    code, out, err = recorder.end(signal.SIGINT)
    assert (code, err) == (0, "")
    assert out.startswith("recorded ")
    assert recorder.stamps_by_rosbags() == list(range(500))
    assert recorder.stamps_by_mcap() == list(range(500))
    with Reader(recorder.directory) as reader:
        counts = {c.topic: c.msgcount for c in reader.connections}
        assert counts[f"{ROBOT}/{METADATA.name}"] == 1
        # The latched one before it was there and the one after, which came twice, and that of a default publisher.
        assert counts[f"{ROBOT}/{GOAL_POSE.name}"] == 3
        assert {c.topic for c in reader.connections} >= {f"{ROBOT}/odom", "/clock", "/diagnostics"}
    said = open_bag(recorder.directory).topics["/diagnostics"].data[0]
    assert b"floating_platform: recorder" in said
    check_provenance(recorder.file())
    with pytest.raises(ProcessLookupError):
        os.kill(recorder.process.pid, 0)
    assert not [thread for thread in threading.enumerate() if thread.name == "bag"]


def test_a_paused_recorder_says_when_a_message_was_sent_and_received_and_sigterm_closes_its_bag(record, node):
    early = node.create_publisher(PoseStamped, GOAL_POSE.name, publisher_qos(GOAL_POSE))
    latched = [time.time_ns(), early.publish(PoseStamped()), time.time_ns()]
    time.sleep(0.2)
    recorder = record()
    recorder.wait_until_recording()
    publisher = odometry(node)
    recorder.pause()
    spans = []
    for stamp in range(20):
        before = time.time_ns()
        publish(publisher, [stamp], period_s=0.0)
        spans.append((before, time.time_ns()))
    time.sleep(0.5)
    went_on = time.time_ns()
    recorder.process.send_signal(signal.SIGCONT)
    assert publisher.wait_for_all_acked(Duration(seconds=5.0))
    publish(publisher, range(20, 40))
    assert publisher.wait_for_all_acked(Duration(seconds=5.0))
    assert recorder.end(signal.SIGTERM)[0] == 0
    assert recorder.stamps_by_rosbags() == list(range(40))
    topics = open_bag(recorder.directory).topics
    odom, goal = topics[f"{ROBOT}/odom"], topics[f"{ROBOT}/{GOAL_POSE.name}"]
    for (before, after), sent, received in zip(spans, odom.publish_ns, odom.log_ns, strict=False):
        assert before <= sent <= after
        assert received >= went_on
    # A latched message was sent before anybody recorded.
    assert latched[0] <= goal.publish_ns[0] <= latched[2] < goal.log_ns[0]


def check_provenance(file):
    """A bag carries the code and the packages that made it."""
    with file.open("rb") as stream:
        files = {file.name: file.data for file in make_reader(stream).iter_attachments()}
    reported = json.loads(files["provenance.json"])
    assert reported["packages"]["numpy"] == version("numpy")
    assert set(reported) == {"fulmar_version", "git_revision", "python", "platform", "packages"}


def test_a_recorder_that_is_started_again_goes_on_in_the_bag_of_the_one_that_died(record, node):
    (recorder := record()).wait_until_recording()
    publisher = odometry(node, lockstep=True)  # keeps what a busy machine holds the second one up for
    publish(publisher, range(50))
    wait_for(lambda: len(recorder.stamps_by_rosbags()) == 50)
    recorder.end(signal.SIGKILL)
    again = record("resume:=true")
    again.wait_until_recording()
    stamp = 100
    while len(recorder.stamps_by_rosbags()) < 100:  # they find each other after a second or two
        assert stamp < 3000
        publish(publisher, range(stamp, stamp + 100))
        stamp += 100
    wait_for(lambda: says_what_it_missed(again))  # it reports once a second
    assert again.end(signal.SIGINT)[0] == 0
    kept = again.stamps_by_rosbags()
    assert kept[:50] == list(range(50))
    assert kept[50:] == list(range(kept[50], stamp))
    assert says_what_it_missed(again)


def says_what_it_missed(recorder):
    health = open_bag(recorder.directory).topics.get("/diagnostics")
    missed = b"the recorder was started again: nothing was recorded for"
    return health is not None and any(missed in data for data in health.data)


@real_time
def test_a_killed_recorder_leaves_a_bag_up_to_its_last_second(record, node):
    recorder = record()
    recorder.wait_until_recording()
    publisher = odometry(node)
    begin = time.monotonic()
    sent = []
    while time.monotonic() - begin < 1.6:
        publish(publisher, [len(sent)], period_s=0.01)
        sent.append(time.monotonic())
    recorder.end(signal.SIGKILL)
    kept = recorder.stamps_by_rosbags()
    assert kept == recorder.stamps_by_mcap() == list(range(len(kept)))
    lost_s = sent[-1] - sent[kept[-1]]
    assert lost_s < 1.3, "half a second between flushes, the rest for a busy machine"


@pytest.mark.slow
@real_time
def test_in_lock_step_a_paused_recorder_is_waited_for_and_lacks_nothing(record, node):
    recorder = record()
    recorder.wait_until_recording()
    publisher = odometry(node, lockstep=True)
    recorder.pause()
    threading.Timer(2.0, recorder.process.send_signal, (signal.SIGCONT,)).start()
    message, begin, slowest_s = Odometry(), time.monotonic(), 0.0
    for stamp in range(6000):  # more than the history of a publisher that keeps everything
        message.header.stamp.sec = stamp
        before = time.monotonic()
        publish_patiently(publisher, message)
        slowest_s = max(slowest_s, time.monotonic() - before)
    assert time.monotonic() - begin > 2.0, "nothing was waited for"
    assert slowest_s > 0.2
    assert publisher.wait_for_all_acked(Duration(seconds=5.0))
    assert recorder.end(signal.SIGINT)[0] == 0
    assert recorder.stamps_by_rosbags() == list(range(6000))


def test_in_lock_step_a_recorder_that_hangs_ends_the_waiting_with_a_reason(record, node, monkeypatch):
    monkeypatch.setattr("fulmar_ros.qos.PATIENCE_S", 0.3)
    recorder = record()
    recorder.wait_until_recording()
    publisher = odometry(node, lockstep=True)
    recorder.pause()
    with pytest.raises(LockstepError, match="a reader has taken nothing for 0"):
        for _ in range(20_000):
            publish_patiently(publisher, Odometry())


@real_time
def test_in_real_time_a_recorder_that_hangs_holds_up_nothing(record, node):
    recorder = record()
    recorder.wait_until_recording()
    publisher = odometry(node)

    def round_s() -> float:
        begin = time.monotonic()
        for _ in range(2000):
            publisher.publish(Odometry())
        return time.monotonic() - begin

    received_s = [round_s() for _ in range(3)]
    recorder.pause()
    hung_s = [round_s() for _ in range(3)]
    # Who is held up is so each time; the machine's own pauses are not.
    assert statistics.median(hung_s) < 3.0 * statistics.median(received_s)


PUBLISHES_AND_ASKS = """
import sys, time
import rclpy
from nav_msgs.msg import Odometry
from rclpy.duration import Duration
from fulmar_core.robots.topics import ODOMETRY
from fulmar_ros.qos import publisher_qos
from fulmar_ros.middleware import set_up_middleware
set_up_middleware()
rclpy.init()
node = rclpy.create_node("talker", namespace=sys.argv[1])
publisher = node.create_publisher(Odometry, ODOMETRY.name, publisher_qos(ODOMETRY))
while not publisher.get_subscription_count():
    time.sleep(0.01)
time.sleep(0.5)
publisher.publish(Odometry())
print(publisher.wait_for_all_acked(Duration(seconds=1.5)))
"""


@real_time
def test_a_publisher_learns_soon_what_has_arrived(record, ros_domain):
    """By itself Fast DDS asks every 3 s, when the last 50 messages of a 200 Hz publisher are long gone."""
    record().wait_until_recording()
    asked = [sys.executable, "-c", PUBLISHES_AND_ASKS, ROBOT]
    done = subprocess.run(asked, env=ros_domain.env, capture_output=True, text=True, timeout=30, check=True)
    assert done.stdout == "True\n"


def test_an_existing_bag_is_refused_with_one_line(record, tmp_path):
    (tmp_path / "bag").mkdir()
    (tmp_path / "bag" / "bag_0.mcap").write_bytes(b"precious")
    recorder = record()
    out, err = recorder.process.communicate(timeout=20)
    assert recorder.process.returncode == 2
    assert out == ""
    assert err.count("\n") == 1
    assert f"{tmp_path / 'bag'} exists already" in err
    assert (tmp_path / "bag" / "bag_0.mcap").read_bytes() == b"precious"


def test_broken_run_information_is_refused_with_one_line(record):
    recorder = record("run_info:='{not json'")
    _, err = recorder.process.communicate(timeout=20)
    assert recorder.process.returncode == 2
    assert err.count("\n") == 1
    assert "run_info" in err


def values(status: DiagnosticStatus) -> dict[str, str]:
    return {pair.key: pair.value for pair in status.values}


def test_a_full_disk_ends_in_exit_code_1_with_all_before_it_kept(record, node, healths):
    recorder = record()
    recorder.wait_until_recording()
    publisher = odometry(node)
    publish(publisher, range(10))
    wait_for(lambda: len(recorder.stamps_by_rosbags()) == 10)
    size = recorder.file().stat().st_size
    resource.prlimit(recorder.process.pid, resource.RLIMIT_FSIZE, (size, resource.RLIM_INFINITY))
    publish(publisher, range(10, 600))
    wait_for(lambda: healths and "what comes waits in memory" in healths[-1].message)
    assert healths[-1].level == DiagnosticStatus.ERROR
    code, _, err = recorder.end(signal.SIGINT)
    assert code == 1
    assert err.count("Make room and they will be written") == 1
    assert "messages are not in the bag" in err
    assert recorder.stamps_by_rosbags() == list(range(10))


@pytest.mark.slow
@real_time
def test_a_recorder_splits_by_time(record, node):
    recorder = record("split_s:=0.5")
    recorder.wait_until_recording()
    publish(odometry(node), range(200), period_s=0.01)
    assert recorder.end(signal.SIGINT)[0] == 0
    assert len(list(recorder.directory.glob("*.mcap"))) > 2
    assert recorder.stamps_by_rosbags() == list(range(200))


def test_an_unknown_mode_is_refused_with_one_line(record):
    recorder = record("mode:=rnig")
    _, err = recorder.process.communicate(timeout=20)
    assert recorder.process.returncode == 2
    assert "rnig" in err
    assert err.count("\n") == 1
