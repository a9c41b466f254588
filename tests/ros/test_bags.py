"""Bags go back onto ROS, and through the deployed node."""

from __future__ import annotations

import threading
from pathlib import Path

import pytest
import rclpy
from nav_msgs.msg import Odometry
from rclpy.signals import SignalHandlerOptions
from rosgraph_msgs.msg import Clock

from fulmar_bags.contents import open_bag
from fulmar_bags.decode import stamps_ns
from fulmar_bags.message_reader import stamp_ns
from fulmar_bags.stored_bytes import picked
from fulmar_bringup.player import play, schedule
from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.topics import CLOCK, ODOMETRY
from fulmar_evaluation.rerun.reference_bags import TOLERANCES
from fulmar_ros.qos import subscriber_qos
from tests.conftest import RosDomain
from tests.ros.cli import fulmar, json_of

BAGS = Path(__file__).resolve().parents[1] / "replay" / "bags"
POLICY, LQR = BAGS / "floating_platform_go_to_pose_policy", BAGS / "floating_platform_go_to_pose_lqr"


@pytest.fixture
def received(ros_domain: RosDomain):
    """What a listener in a context of its own receives: odometry as bytes, and the clock."""
    found: dict[str, list] = {"odom": [], "clock": []}
    context = rclpy.Context()
    rclpy.init(args=[], context=context, signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node("listener", context=context)
    qos = subscriber_qos(ODOMETRY, reliable=True, depth=500)
    node.create_subscription(
        Odometry, "/floating_platform/odom", found["odom"].append, qos, raw=True
    )  # raw: a message that is written again has other bytes between its fields
    node.create_subscription(
        Clock,
        CLOCK.name,
        lambda m: found["clock"].append(stamp_ns(m.clock)),
        subscriber_qos(CLOCK, depth=500),
    )
    executor = rclpy.executors.SingleThreadedExecutor(context=context)
    executor.add_node(node)
    thread = threading.Thread(target=executor.spin, daemon=True)
    thread.start()
    yield found
    executor.shutdown()
    thread.join(5.0)
    rclpy.try_shutdown(context=context)


@pytest.mark.real_time
@pytest.mark.slow
def test_a_bag_is_played_byte_for_byte_with_its_clock(received):
    bag = open_bag(POLICY)
    plan = schedule(bag, topics=["odom"])
    done = play(plan, bag, rate=10.0, clock=True, wait_s=3.0)
    assert done.messages == 100
    assert received["odom"] == bag.of(ODOMETRY).data
    stamps = stamps_ns(bag.of(ODOMETRY))
    assert len(received["clock"]) > 20
    assert received["clock"] == sorted(received["clock"])
    assert stamps[0] <= received["clock"][0]
    assert received["clock"][-1] <= stamps[-1]


def test_a_lockstep_bag_plays_at_the_pace_of_its_stamps():
    bag = open_bag(POLICY)
    plan = schedule(bag, topics=["odom"])
    assert (plan.end_ns - plan.begin_ns) / 1e9 == pytest.approx(19.8)
    assert plan.times_ns == stamps_ns(bag.of(ODOMETRY)).tolist()


def test_playing_from_later_still_states_the_goal():
    bag = open_bag(POLICY)
    plan = schedule(bag, start_s=10.0)
    names = [
        name for name, time_ns in zip(plan.topics, plan.times_ns, strict=True) if time_ns == plan.begin_ns
    ]
    assert "/floating_platform/goal_pose" in names
    assert sum(name.endswith("/odom") for name in plan.topics) in (49, 50, 51)
    with pytest.raises(ConfigError, match="Begin earlier"):
        schedule(bag, start_s=1000.0)
    with pytest.raises(ConfigError, match="Did you mean 'odom'"):
        schedule(bag, topics=["odomm"])


def test_a_loop_begins_again_until_it_is_stopped(ros_domain: RosDomain):
    bag = open_bag(POLICY)
    stop = threading.Event()
    threading.Timer(2.5, stop.set).start()
    done = play(schedule(bag, topics=["odom"]), bag, rate=100.0, loop=True, wait_s=0.1, stop=stop)
    assert done.rounds >= 2
    assert done.messages > 100


def rerun_through_node(bag: Path) -> list[str]:
    """The command line that re-runs a reference bag on any processor."""
    tolerances = [f"--tolerance={field}={limit}" for field, limit in TOLERANCES.items()]
    return ["bag", "rerun", str(bag), "--through", "node", *tolerances, "--json"]


@pytest.mark.slow
@pytest.mark.parametrize("bag", [POLICY, LQR], ids=lambda bag: bag.name)
def test_the_deployed_node_gives_the_recorded_answers(bag: Path, ros_domain: RosDomain, tmp_path: Path):
    done = fulmar(*rerun_through_node(bag), env=ros_domain.env, cwd=tmp_path)
    found = json_of(done.stdout)
    assert done.returncode == 0, found["first_difference"]
    assert found["asked"] == found["steps"]


def test_the_deployed_node_is_given_the_guards_of_the_run(ros_domain: RosDomain, tmp_path: Path):
    bag = BAGS / "floating_platform_go_to_pose_lqr_guarded"  # may act for 15 of its 20 s
    done = fulmar(*rerun_through_node(bag), env=ros_domain.env, cwd=tmp_path)
    found = json_of(done.stdout)
    assert done.returncode == 0, found["first_difference"]
    assert found["asked"] == 76


@pytest.mark.slow
def test_another_controller_behind_the_node_is_found_out(ros_domain: RosDomain, tmp_path: Path):
    asked = ("--through", "node", "--controller", "lqr", "--json")
    done = fulmar("bag", "rerun", str(POLICY), *asked, env=ros_domain.env, cwd=tmp_path)
    assert done.returncode == 1
    assert json_of(done.stdout)["first_difference"]["field"] == "action"


def test_a_stamp_that_comes_twice_does_not_change_the_pace(tmp_path: Path):
    bag = open_bag(POLICY)
    odometry = bag.of(ODOMETRY)
    numbers = sorted((*range(len(odometry)), 10))
    odometry.data = picked(odometry.data, numbers)
    odometry.log_ns.insert(11, odometry.log_ns[10] + 1)
    odometry.publish_ns.insert(11, odometry.publish_ns[10])
    odometry.sequence.insert(11, 0)
    plan = schedule(bag, topics=["odom"])
    assert (plan.end_ns - plan.begin_ns) / 1e9 == pytest.approx(19.8)
