"""A plain rclpy client resets, pauses, steps, reads and sets a simulated robot by ROS's simulation_interfaces."""

from __future__ import annotations

import contextlib
import json
import math
import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import rclpy
from action_msgs.msg import GoalStatus
from geometry_msgs.msg import Vector3
from rclpy.action import ActionClient
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from simulation_interfaces import srv as services
from simulation_interfaces.action import SimulateSteps
from simulation_interfaces.msg import Bounds, EntityCategory, Result, SimulationState, SimulatorFeatures
from std_msgs.msg import String

from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import SIMULATION_EVENT
from fulmar_ros.controller_node import ControllerNode
from fulmar_ros.operator_subscription import subscribe_every
from fulmar_ros.plant_node import PlantNode
from fulmar_ros.runtime import spinning
from fulmar_ros.simulation_interfaces_node import SimulationInterfacesNode
from sim_nodes.sim_node import make_backend
from tests.conftest import RosDomain
from tests.fulmar_bringup.test_interface_definitions import FOLDER, Definitions
from tests.ros.controllers import make_lqr
from tests.ros.neighbour import until

pytestmark = pytest.mark.real_time
NAME = "floating_platform"
OK, PAUSED, PLAYING, STOPPED = (
    Result.RESULT_OK,
    SimulationState.STATE_PAUSED,
    SimulationState.STATE_PLAYING,
    SimulationState.STATE_STOPPED,
)


class Simulation:
    """A client of every service, and the nodes that it asks."""

    def __init__(self, node: Node, plant: PlantNode, server: SimulationInterfacesNode) -> None:
        self.node, self.plant, self.server = node, plant, server
        self.events: list[dict[str, Any]] = []
        subscribe_every(node, String, SIMULATION_EVENT, lambda m: self.events.append(json.loads(m.data)))

    def ask(self, kind: str, **fields: Any) -> Any:
        """Call a service as a plain client does."""
        service = getattr(services, kind)
        words = "".join(f"_{letter.lower()}" if letter.isupper() else letter for letter in kind)
        client = self.node.create_client(service, words.strip("_"))
        assert client.wait_for_service(20.0)
        for _ in range(3):  # rclpy may miss the answer to a call from another thread than its executor's
            asked = client.call_async(service.Request(**fields))
            with contextlib.suppress(AssertionError):
                until(asked.done, 15.0)
                break
        self.node.destroy_client(client)
        return asked.result()

    def result(self, kind: str, **fields: Any) -> int:
        return int(self.ask(kind, **fields).result.result)

    def turn(self, state: int) -> int:
        return self.result("SetSimulationState", state=SimulationState(state=state))

    @property
    def place(self) -> tuple[float, float]:
        answer = self.ask("GetEntityState", entity=NAME)
        assert answer.result.result == OK, answer.result.error_message
        return answer.state.pose.position.x, answer.state.pose.position.y

    def put(self, x: float, y: float, *, frame: str = "", yaw: float = 0.0, **more: Any) -> Any:
        request = services.SetEntityState.Request(entity=more.pop("entity", NAME))
        request.state.header.frame_id = frame
        pose, twist = request.state.pose, request.state.twist
        pose.position.x, pose.position.y = x, y
        pose.orientation.z, pose.orientation.w = math.sin(0.5 * yaw), math.cos(0.5 * yaw)
        twist.linear.x = more.pop("vx", 0.0)
        return self.ask("SetEntityState", entity=request.entity, state=request.state)


@contextlib.contextmanager
def simulation_of(*, lockstep: bool = False, origin: str = "") -> Iterator[Simulation]:
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)

    def arguments(**more: object) -> list[str]:
        given = (word for key, value in more.items() for word in ("-p", f"{key}:={value}"))
        return ["--ros-args", "-r", f"__ns:=/{NAME}", "-p", f"robot:={NAME}", *given]

    def fail(error: Exception) -> None:
        pytest.fail(repr(error))

    def end(_code: int) -> None:
        return

    with contextlib.ExitStack() as stack:
        stack.callback(rclpy.try_shutdown)
        node = Node("client", namespace=f"/{NAME}")
        stack.enter_context(spinning(node, fail))
        mode = {"lockstep": lockstep}
        where = {"origin": origin} if origin else {}
        plant = PlantNode(make_backend, end, cli_args=arguments(backend="mock", **mode, **where))
        stack.enter_context(spinning(plant, fail))
        stack.callback(plant.stop)
        if lockstep:
            controller = ControllerNode(make_lqr, end, cli_args=arguments(**mode))
            stack.enter_context(spinning(controller, fail))
            stack.callback(controller.stop)
        server = SimulationInterfacesNode(end, cli_args=arguments())
        for each in (server, *server.companions):
            stack.enter_context(spinning(each, fail))
        simulation = Simulation(node, plant, server)
        until(lambda: bool(server._plant.entities(NAME)), 20.0)
        yield simulation


@pytest.fixture
def simulation(ros_domain: RosDomain) -> Iterator[Simulation]:
    with simulation_of() as simulation:
        yield simulation


def test_a_client_pauses_steps_and_plays_as_fulmar_simulation_does(simulation: Simulation) -> None:
    assert simulation.ask("GetSimulationState").state.state == PLAYING
    assert simulation.turn(PAUSED) == OK
    assert simulation.ask("GetSimulationState").state.state == PAUSED
    assert simulation.turn(PAUSED) == services.SetSimulationState.Response.ALREADY_IN_TARGET_STATE
    first = simulation.plant.clock.now_ns
    time.sleep(0.3)
    assert simulation.plant.clock.now_ns == first
    assert simulation.result("StepSimulation", steps=3) == OK
    period_ns = round(1e9 / load_robot(NAME).timing.control_hz)
    assert simulation.plant.clock.now_ns == first + 3 * period_ns
    assert simulation.turn(PLAYING) == OK
    until(lambda: simulation.plant.clock.now_ns > first + 5 * period_ns)
    until(lambda: [event["what"] for event in simulation.events] == ["pause", "step", "resume"])
    assert simulation.events[1]["steps"] == 3


def test_a_simulation_that_plays_takes_no_steps(simulation: Simulation) -> None:
    answer = simulation.ask("StepSimulation", steps=1)
    assert answer.result.result == Result.RESULT_OPERATION_FAILED
    assert "not paused" in answer.result.error_message


def test_a_state_is_set_read_and_recorded(simulation: Simulation) -> None:
    assert simulation.turn(PAUSED) == OK
    answer = simulation.put(2.0, -1.0, yaw=0.5, vx=0.1)
    assert answer.result.result == OK, answer.result.error_message
    state = simulation.ask("GetEntityState", entity=NAME).state
    assert (state.pose.position.x, state.pose.position.y) == pytest.approx((2.0, -1.0))
    assert (state.twist.linear.x, state.header.frame_id) == (pytest.approx(0.1), "odom")
    assert simulation.result("StepSimulation", steps=1) == OK
    assert simulation.place == pytest.approx((2.01, -1.0), abs=0.02)
    (event,) = [event for event in simulation.events if event["what"] == "place"]
    assert event["by"] == "simulation_interfaces" and event["position_m"] == [2.0, -1.0, 0.0]
    assert event["velocity_m_s"] == [0.1, 0.0, 0.0] and event["stamp_ns"] > 0


def test_a_reset_goes_back_to_the_start_and_time_goes_on(simulation: Simulation) -> None:
    simulation.put(3.0, 0.0)
    assert simulation.place == pytest.approx((3.0, 0.0), abs=0.01)
    before = simulation.plant.clock.now_ns
    answer = simulation.ask("ResetSimulation")
    assert (answer.result.result, answer.result.error_message) == (OK, "simulated time goes on.")
    assert simulation.place == pytest.approx((0.0, 0.0), abs=0.01)
    assert simulation.plant.clock.now_ns > before
    kind = services.ResetSimulation.Request
    only_time = simulation.ask("ResetSimulation", scope=kind.SCOPE_TIME)
    assert only_time.result.result == Result.RESULT_FEATURE_UNSUPPORTED
    assert "never goes back" in only_time.result.error_message
    assert simulation.result("ResetSimulation", scope=kind.SCOPE_STATE) == OK
    assert simulation.result("ResetSimulation", scope=kind.SCOPE_SPAWNED) == OK


def test_a_simulation_that_is_stopped_waits_at_its_start(simulation: Simulation) -> None:
    simulation.put(3.0, 0.0)
    assert simulation.turn(STOPPED) == OK
    assert simulation.ask("GetSimulationState").state.state == STOPPED
    assert simulation.place == pytest.approx((0.0, 0.0))
    assert simulation.turn(PLAYING) == OK
    assert simulation.ask("GetSimulationState").state.state == PLAYING
    assert simulation.place == pytest.approx((0.0, 0.0), abs=0.01)


def test_what_cannot_be_is_refused_with_the_code_of_the_standard(simulation: Simulation) -> None:
    elsewhere = simulation.put(1.0, 0.0, entity="husky")
    assert elsewhere.result.result == Result.RESULT_NOT_FOUND
    assert elsewhere.result.error_message == f"there is no entity 'husky'. There are: {NAME}."
    too_far = simulation.put(1e9, 0.0)
    assert too_far.result.result == services.SetEntityState.Response.INVALID_POSE
    assert "within 100,000 m" in too_far.result.error_message
    frame, until = simulation.put(1.0, 0.0, frame="camera"), time.monotonic() + 10.0
    while "map" not in frame.result.error_message and time.monotonic() < until:  # the origin is under way
        frame = simulation.put(1.0, 0.0, frame="camera")
    assert frame.result.result == Result.RESULT_OPERATION_FAILED
    assert "frame is 'camera', must be one of world, odom, map" in frame.result.error_message
    unsupported = Result.RESULT_FEATURE_UNSUPPORTED
    assert simulation.turn(SimulationState.STATE_QUITTING) == unsupported
    for kind, fields in (
        ("SpawnEntity", {"name": "x"}),
        ("DeleteEntity", {"entity": NAME}),
        ("GetSpawnables", {}),
    ):
        answer = simulation.ask(kind, **fields)
        assert answer.result.result == unsupported and answer.result.error_message


def test_entities_are_found_by_name_category_and_sphere(simulation: Simulation) -> None:
    def found(**filters: Any) -> list[str]:
        request = services.GetEntities.Request()
        for key, value in filters.items():
            setattr(request.filters, key, value)
        answer = simulation.ask("GetEntities", filters=request.filters)
        assert answer.result.result == OK, answer.result.error_message
        return list(answer.entities)

    near = Bounds(type=Bounds.TYPE_SPHERE, points=[Vector3(), Vector3(x=1.0)])
    far = Bounds(type=Bounds.TYPE_SPHERE, points=[Vector3(x=9.0), Vector3(x=1.0)])
    robot, human = (
        EntityCategory(category=kind)
        for kind in (EntityCategory.CATEGORY_ROBOT, EntityCategory.CATEGORY_HUMAN)
    )
    assert found() == found(filter="float.*") == found(categories=[robot]) == found(bounds=near) == [NAME]
    assert found(filter="husky") == found(categories=[human]) == found(bounds=far) == []
    request = services.GetEntitiesStates.Request()
    answer = simulation.ask("GetEntitiesStates", filters=request.filters)
    assert len(answer.states) == len(answer.entities) == 1
    request.filters.filter = "("
    bad = simulation.ask("GetEntities", filters=request.filters)
    assert (
        bad.result.result == Result.RESULT_OPERATION_FAILED
        and "regular expression" in bad.result.error_message
    )


def test_the_features_are_those_that_are_served(simulation: Simulation) -> None:
    features = simulation.ask("GetSimulatorFeatures").features
    assert SimulatorFeatures.ENTITY_STATE_SETTING in features.features
    assert SimulatorFeatures.STEP_SIMULATION_ACTION in features.features
    assert SimulatorFeatures.SPAWNING not in features.features
    assert SimulatorFeatures.SIMULATION_RESET_TIME not in features.features


def test_steps_are_taken_by_an_action_and_can_be_cancelled(simulation: Simulation) -> None:
    client, got = ActionClient(simulation.node, SimulateSteps, "simulate_steps"), []
    until(client.server_is_ready, 20.0)

    def send(steps: int) -> Any:
        asked = client.send_goal_async(
            SimulateSteps.Goal(steps=steps), feedback_callback=lambda message: got.append(message.feedback)
        )
        until(asked.done, 10.0)
        return asked.result()

    def outcome(handle: Any) -> tuple[int, Any]:
        asked = handle.get_result_async()
        until(asked.done, 20.0)
        return asked.result().status, asked.result().result.result

    status, result = outcome(send(2))
    assert (status, result.result) == (GoalStatus.STATUS_ABORTED, Result.RESULT_OPERATION_FAILED)
    assert simulation.turn(PAUSED) == OK
    status, result = outcome(send(3))
    assert (status, result.result) == (GoalStatus.STATUS_SUCCEEDED, OK)
    assert [(each.completed_steps, each.remaining_steps) for each in got] == [(1, 2), (2, 1), (3, 0)]
    handle = send(1000)
    until(lambda: len(got) >= 5, 20.0)
    handle.cancel_goal_async()
    status, result = outcome(handle)
    assert (status, result.result) == (GoalStatus.STATUS_CANCELED, OK)
    assert "of 1000 steps are done" in result.error_message


def test_a_pose_in_map_is_put_where_odom_sees_it(ros_domain: RosDomain) -> None:
    with simulation_of(origin="[10.0, 5.0, 90.0]") as simulation:
        until(lambda: simulation.server._plant.origin is not None, 10.0)
        assert simulation.put(10.0, 7.0, frame="map", yaw=0.5 * math.pi).result.result == OK
        assert simulation.place == pytest.approx((2.0, 0.0), abs=0.01)


def test_in_lock_step_a_step_is_over_when_its_service_answers(ros_domain: RosDomain) -> None:
    with simulation_of(lockstep=True) as simulation:
        assert simulation.turn(PAUSED) == OK
        time.sleep(0.2)
        first = simulation.plant.clock.now_ns
        assert simulation.result("StepSimulation", steps=5) == OK
        period_ns = round(1e9 / load_robot(NAME).timing.control_hz)
        assert simulation.plant.clock.now_ns == first + 5 * period_ns
        answer = simulation.ask("GetEntityState", entity=NAME)
        stamp = answer.state.header.stamp
        assert stamp.sec * 1_000_000_000 + stamp.nanosec == first + 5 * period_ns
        assert simulation.put(1.0, 1.0).result.result == OK
        assert simulation.result("StepSimulation", steps=1) == OK
        assert simulation.place == pytest.approx((1.0, 1.0), abs=0.05)


def test_the_types_that_were_built_have_the_hashes_of_their_definitions() -> None:
    definitions, checked = Definitions(), 0
    prefixes = os.environ.get("AMENT_PREFIX_PATH", sys.prefix).split(os.pathsep)
    places = (Path(prefix) / "share" / "simulation_interfaces" for prefix in prefixes)
    folder = next(place for place in places if place.is_dir())
    for file in (FOLDER / "simulation_interfaces" / "srv").glob("*.srv"):
        found = json.loads((folder / "srv" / f"{file.stem}.json").read_text())
        hashes = {each["type_name"]: each["hash_string"] for each in found["type_hashes"]}
        name = f"simulation_interfaces/srv/{file.stem}"
        assert hashes[name] == f"RIHS01_{definitions.hash_of(name)}"
        checked += 1
    assert checked == 12
