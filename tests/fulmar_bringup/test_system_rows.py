"""The rows of a system together: whom each waits for, and rows that cannot work together."""

from __future__ import annotations

from dataclasses import replace

import pytest

from fulmar_bringup.fleet_file import system_names
from fulmar_bringup.launched_system import list_nodes
from fulmar_bringup.node_spec import NodeSpec
from fulmar_bringup.run_plan import RunPlan
from fulmar_bringup.system import Guards, load_system
from fulmar_bringup.system_rows import check_rows, system_rows
from fulmar_core.config.errors import ConfigError

PLAN = RunPlan("floating_platform", "go_to_pose", "lqr", "mujoco", 50.0)
ESTIMATED = replace(PLAN, guards=Guards(estimator="mocap_imu"), lockstep=True)


def test_plant_and_controller_wait_for_those_who_subscribe_their_topics():
    def awaited(plan, record):
        rows = system_rows(plan, record=record)
        return [
            row.parameters["wait_for_subscribers"]
            for row in rows.values()
            if row.name in ("plant", "controller")
        ]

    assert awaited(PLAN, {}) == [2, 2]  # recorder and controller; recorder and plant
    assert awaited(PLAN, None) == [1, 1]
    assert awaited(replace(PLAN, goals="/x/lab_pose.yaml"), {}) == [3, 2]
    assert awaited(replace(PLAN, guards=Guards(estimator="mocap_imu")), {}) == [
        2,
        2,
    ]  # poses: recorder, estimator
    external = replace(PLAN, controller="external")
    assert awaited(external, {}) == [1]
    assert awaited(replace(external, lockstep=True), {}) == [2]


def own_node(name="camera", inputs=(), outputs=("image",)):
    return NodeSpec(name, "mine", "camera_node", "mine.camera_node", "/x", inputs=inputs, outputs=outputs)


def test_two_nodes_of_one_name_are_refused():
    with pytest.raises(
        ConfigError, match=r"two nodes are called 'plant': sim_nodes.sim_node and mine.camera_node"
    ):
        system_rows(replace(PLAN, nodes=(own_node("plant"),)))


def test_an_input_that_nothing_publishes_is_refused_with_the_nearest_topic():
    with pytest.raises(
        ConfigError, match=r"node 'camera' receives 'odmo', which nothing .* Did you mean 'odom'"
    ):
        system_rows(replace(PLAN, nodes=(own_node(inputs=("odmo",)),)))
    assert "camera" in system_rows(replace(PLAN, nodes=(own_node(inputs=("odom", "estop", "image")),)))


def test_a_second_clock_is_refused():
    with pytest.raises(ConfigError, match="plant and camera publish /clock"):
        system_rows(replace(PLAN, nodes=(own_node(outputs=("/clock",)),)))


def test_exactly_one_node_of_every_system_publishes_the_clock_of_a_simulation():
    for system in system_names(fleets=False):
        rows = list_nodes(system=system)
        assert sum("/clock" in row.outputs for row in rows) == (load_system(system).backend != "hardware")
        check_rows(rows)


def test_every_row_of_a_named_robot_lies_in_its_namespace(tmp_path):
    guards = Guards(estop=True, estimator="mocap_imu")
    plan = replace(PLAN, name="alpha", goals="/x/lab_pose.yaml", guards=guards)
    rows = system_rows(plan, record={}, wires_folder=tmp_path)
    assert set(rows) >= {"plant", "controller", "recorder", "estop", "estimator", "goals"}
    assert {row.namespace for row in rows.values()} == {"/alpha"}
    assert rows["plant"].parameters["robot"] == "floating_platform"
    assert (plan.robot_name, plan.frames.base) == ("alpha", "alpha/base_link")
    assert (PLAN.robot_name, PLAN.namespace, PLAN.frames.base) == (
        "floating_platform",
        "/floating_platform",
        "base_link",
    )


def test_in_lock_step_an_estimator_answers_the_periods_of_the_plant():
    rows = system_rows(ESTIMATED, record={})
    assert "lockstep/period" in rows["plant"].outputs
    assert rows["plant"].parameters["chain"] == ["estimator"]
    assert rows["estimator"].inputs == ("mocap/pose", "imu/data", "lockstep/period")
    assert rows["estimator"].outputs == ("odom", "lockstep/answer")
    assert rows["recorder"].parameters["lossless"] is True
    awaited = {name: row.parameters.get("wait_for_subscribers") for name, row in rows.items()}
    # Periods: recorder and estimator; odometry: recorder and controller.
    assert (awaited["plant"], awaited["estimator"]) == (2, 2)
    external = system_rows(replace(ESTIMATED, controller="external"), record={})
    assert (
        external["estimator"].parameters["wait_for_subscribers"] == 2
    )  # recorder, and a controller of one's own


@pytest.mark.parametrize("plan", [PLAN, replace(PLAN, lockstep=True), replace(ESTIMATED, lockstep=False)])
def test_no_period_is_published_by_the_clock_or_without_a_node_that_answers_it(plan):
    rows = system_rows(plan, record={})
    assert "lockstep/period" not in rows["plant"].outputs
    assert not {"chain", "lossless", "upstream"} & {name for row in rows.values() for name in row.parameters}


def test_an_own_node_that_publishes_odometry_takes_the_place_of_the_plant():
    def node(**wires):
        return replace(PLAN, lockstep=True, nodes=(own_node("mine", **wires),))

    inputs, outputs = ("mocap/pose", "lockstep/period"), ("odom", "lockstep/answer")
    plan = node(inputs=inputs, outputs=outputs)
    plant = system_rows(plan)["plant"]
    assert (plant.parameters["estimated"], plant.parameters["chain"]) == (True, ["mine"])
    assert "odom" not in plant.outputs
    assert "lockstep/period" not in system_rows(replace(plan, lockstep=False))["plant"].outputs
    with pytest.raises(ConfigError, match=r"its outputs lack 'lockstep/answer'"):
        system_rows(node(inputs=inputs, outputs=("odom",)))
    with pytest.raises(ConfigError, match=r"node 'mine' publishes 'odom': in lock step it answers"):
        system_rows(node(inputs=inputs[:1], outputs=outputs))
    with pytest.raises(ConfigError, match=r"estimator and mine publish odom, and a controller follows one"):
        system_rows(replace(plan, guards=Guards(estimator="mocap_imu")))


def test_an_estimator_waits_for_the_answer_of_a_node_whose_output_it_takes():
    camera = own_node("camera", inputs=("lockstep/period",), outputs=("attitude", "lockstep/answer"))
    rows = system_rows(replace(ESTIMATED, nodes=(camera,)))
    assert rows["estimator"].parameters["upstream"] == ["camera"]
    assert rows["plant"].parameters["chain"] == ["estimator", "camera"]
