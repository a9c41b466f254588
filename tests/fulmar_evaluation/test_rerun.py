"""A controller goes through a recorded run again: the same one says the same, to the bit; another one is found out."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import onnxruntime
import pytest
from rosbags.rosbag2.enums import StoragePlugin
from typer.testing import CliRunner

from fulmar_bags.comparison import compare, first_difference, read_tolerances
from fulmar_bags.contents import open_bag
from fulmar_bags.control_steps import control_steps_of
from fulmar_bags.writer import BagWriter
from fulmar_cli.main import app
from fulmar_core.config.errors import BagError, ConfigError
from fulmar_core.loop.policy_bundle import NETWORK, Golden, read_golden, read_passport, write_bundle
from fulmar_core.robots.calibration import VARIABLE, Calibration, Measured, save_calibration
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import ODOMETRY
from fulmar_evaluation.rerun import live_node
from fulmar_evaluation.rerun.embedded_configs import calibrated_as
from fulmar_evaluation.rerun.reference_bags import TOLERANCES
from fulmar_evaluation.rerun.rerun import rerun
from fulmar_evaluation.rerun.rerun_result import FIELDS, compare_answers
from policy_server.controllers import Choice, load_controller, shipped_policy
from tests.foreign_bag import write_foreign

BAGS = Path(__file__).resolve().parents[1] / "replay" / "bags"
POLICY, LQR = BAGS / "floating_platform_go_to_pose_policy", BAGS / "floating_platform_go_to_pose_lqr"
EXACT = dict.fromkeys(FIELDS, 0.0)


def answered(bag: Path, controller: str, source: str = "observations", record=None):
    record = record or control_steps_of(open_bag(bag))
    folder = shipped_policy(record.robot.name, record.task.name) if controller == "policy" else ""
    hz = record.settings.control_rate(record.robot)
    loaded = load_controller(controller, record.robot, record.task, Choice(hz, str(folder)))
    # Another processor rounds a sine otherwise, of which observations are made anew.
    limits = TOLERANCES if source == "odometry" else EXACT
    return compare_answers(record, rerun(record, loaded, source=source), limits)


def ask(*words: str) -> tuple[int, dict]:
    done = CliRunner().invoke(app, ["bag", "rerun", *words, "--json"], catch_exceptions=False)
    return done.exit_code, json.loads(done.stdout[done.stdout.index("{") :])


@pytest.fixture
def other_bundle(tmp_path) -> Path:
    """The shipped bundle with one layer a little different, sealed as an exporter would."""
    onnx = pytest.importorskip("onnx")
    folder = Path(shutil.copytree(shipped_policy("floating_platform", "go_to_pose"), tmp_path / "bundle"))
    model = onnx.load_from_string((folder / NETWORK).read_bytes())
    largest = max(model.graph.initializer, key=lambda each: int(np.prod(each.dims)))
    weights = onnx.numpy_helper.to_array(largest)
    largest.CopyFrom(onnx.numpy_helper.from_array((0.8 * weights).astype(weights.dtype), largest.name))
    network, golden = model.SerializeToString(), read_golden(folder)
    session = onnxruntime.InferenceSession(network, providers=["CPUExecutionProvider"])
    command, logits = session.run(["command", "logits"], {"observation": golden.observations})
    new = Golden(golden.observations, golden.memories, command, logits, golden.next_memories)
    write_bundle(folder, network, new, read_passport(folder))
    return folder


@pytest.mark.parametrize("source", ["observations", "odometry"])
def test_the_same_bundle_gives_the_same_bits_and_exit_code_0(source):
    limits = {"observations": EXACT, "odometry": TOLERANCES}[source]
    code, found = ask(str(POLICY), "--from", source, *(f"--tolerance={k}={v}" for k, v in limits.items()))
    assert code == 0
    assert found["same"] and found["compared"]
    assert found["sha256"] == read_passport(shipped_policy("floating_platform", "go_to_pose")).sha256
    assert {field["field"] for field in found["fields"]} == set(FIELDS)
    assert all(field["difference"]["max"] <= limits[field["field"]] for field in found["fields"])


@pytest.mark.parametrize("source", ["observations", "odometry"])
def test_a_law_that_watches_its_valves_and_remembers_gives_the_same_bits(source):
    assert first_difference(answered(LQR, "lqr", source)) is None


def test_a_run_is_repeated_with_the_calibration_that_it_was_driven_with(tmp_path, monkeypatch):
    def half_as_strong(name):
        path = tmp_path / name
        save_calibration(Calibration("floating_platform", thrust=Measured(0.5, 0.49, 0.51)), path)
        return path

    carried = {"calibration.yaml": half_as_strong("carried").read_bytes()}
    BagWriter(tmp_path / "bag", run_info={"robot": "floating_platform"}, attachments=carried).close()
    with calibrated_as(open_bag(tmp_path / "bag")):
        assert load_robot("floating_platform").actuators.thrust == 0.5
    monkeypatch.setenv(VARIABLE, str(half_as_strong("mine")))
    with calibrated_as(open_bag(POLICY)):
        assert load_robot("floating_platform").actuators.thrust == 1.0
    assert load_robot("floating_platform").actuators.thrust == 0.5


def test_another_bundle_is_found_out_with_its_first_step(other_bundle):
    code, found = ask(str(POLICY), "--controller", "policy", "--policy", str(other_bundle))
    first = found["first_difference"]
    assert code == 1
    assert not found["same"]
    assert first["field"] == "action"
    assert first["recorded"] != first["found"]
    steps = [field["first_step"] for field in found["fields"] if field["differing"]]
    assert first["first_step"] == min(steps)


def test_another_controller_is_found_out_for_people_too():
    done = CliRunner().invoke(app, ["bag", "rerun", str(POLICY), "--controller", "lqr"])
    assert done.exit_code == 1
    assert "first difference: step" in done.stdout
    assert "another controller than recorded" in done.stdout


def test_a_tolerance_lets_small_differences_pass():
    stamps = np.arange(3)
    recorded, found = np.array([[1.0], [2.0], [3.0]]), np.array([[1.0], [2.0 + 1e-7], [3.0]])
    (exact,) = compare("action", ["a"], recorded, found, stamps)
    assert (exact.first_step, exact.differing) == (1, 1)
    (loose,) = compare("action", ["a"], recorded, found, stamps, 1e-6)
    assert loose.same


def test_a_value_that_one_side_lacks_differs_whatever_the_tolerance():
    (field,) = compare(
        "action", ["a"], np.array([[1.0], [np.nan]]), np.array([[1.0], [2.0]]), np.arange(2), 10.0
    )
    assert (field.first_step, field.recorded, field.found) == (1, None, 2.0)


def test_minus_zero_is_not_the_same_bits_as_zero():
    (field,) = compare("action", ["a"], np.array([[0.0]]), np.array([[-0.0]]), np.arange(1))
    assert field.differing == 1


def test_tolerances_are_reported_by_field_and_refused_where_they_make_no_sense():
    assert read_tolerances(["1e-3", "action=2"], FIELDS)["action"] == 2.0
    assert read_tolerances(["1e-3"], FIELDS)["command"] == 1e-3
    for wrong in ("-1", "action=much", "acton=1", "nan"):
        with pytest.raises(ConfigError):
            read_tolerances([wrong], FIELDS)


def test_observations_of_another_controller_are_refused_with_the_way_out():
    record = control_steps_of(open_bag(POLICY))
    fewer = replace(
        record, observation_names=record.observation_names[:-1], observations=record.observations[:, :-1]
    )
    with pytest.raises(BagError, match="Use --from odometry"):
        answered(POLICY, "policy", record=fewer)


def test_a_controller_forgets_at_a_pause_as_in_the_node():
    record = control_steps_of(open_bag(POLICY))
    seen = []

    class Forgetful:
        name, control_hz, estimator = "forgetful", 5.0, None
        readings, observer = (), None

        def reset(self):
            seen.append("reset")

        def act(self, inputs):
            seen.append("act")
            return record.robot.actuators.safe_command[None]

    later = record.stamp_ns + np.where(np.arange(len(record)) >= 40, 3_000_000_000, 0)
    rerun(replace(record, stamp_ns=later), Forgetful())
    steps = [index for index, what in enumerate(what for what in seen if what) if what == "reset"]
    acts_before = [seen[:index].count("act") for index in steps]
    assert 40 in acts_before
    assert set(acts_before) <= {0, 40}


@pytest.mark.parametrize(
    "option", [["--from", "thoughts"], ["--through", "telepathy"], ["--controller", "lqrr"]]
)
def test_a_mistake_is_reported(option):
    done = CliRunner().invoke(app, ["bag", "rerun", str(POLICY), *option])
    assert isinstance(done.exception, ConfigError)


def test_the_node_is_not_given_bags_of_others_nor_a_goal_of_today(tmp_path):
    foreign = write_foreign(tmp_path / "bag", StoragePlugin.MCAP, count=20)
    asked = ("--controller", "policy", "--robot", "turtlebot2", "--task", "go_to_position", "--goal", "0,0,0")
    done = CliRunner().invoke(app, ["bag", "rerun", str(foreign), *asked, "--through", "node"])
    assert isinstance(done.exception, BagError)
    assert "others recorded it" in str(done.exception)
    done = CliRunner().invoke(app, ["bag", "rerun", str(POLICY), "--goal", "1,1,0", "--through", "node"])
    assert isinstance(done.exception, BagError)
    assert "takes no --goal" in str(done.exception)


def test_the_node_is_fed_the_odometry_that_was_chosen(monkeypatch):
    bag = open_bag(POLICY)
    mine = bag.of(ODOMETRY)
    other = replace(mine, name="/other/odom", data=[data[::-1] for data in mine.data])
    bag = replace(bag, topics={**bag.topics, "/other/odom": other})
    monkeypatch.setattr(live_node.ProcessGroup, "start", lambda group, spec: None)
    monkeypatch.setattr(live_node, "_exchange", lambda raw, *_: (raw["odometry"], None))
    record = control_steps_of(open_bag(POLICY))
    fed, _ = live_node.rerun_through_node(bag, record, "policy", "", "/other/odom")
    assert fed == other.data
