"""A dataset of `fulmar bag export --to lerobot`, loaded with LeRobot itself."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet
import pytest

from fulmar_bags.contents import open_bag
from fulmar_bags.decode import joint_vectors
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import ACTION, OBSERVATION
from tests.bags_with_frames import packed_messages, with_images
from tests.frames import COLOUR, DEPTH, IDS, scene
from tests.fulmar_cli.bag_commands import BAGS, LQR, POLICY, answer
from tests.peers.environment import run_peer

SCRIPT = Path(__file__).with_name("load_dataset.py")


@pytest.mark.slow
@pytest.mark.timeout(300)
@pytest.mark.parametrize(
    ("bags", "robot"),
    [((POLICY, LQR), "floating_platform"), ((BAGS / "turtlebot2_go_to_position_policy",) * 2, "turtlebot2")],
)
def test_lerobot_loads_an_exported_dataset_with_the_values_of_its_bags(pytestconfig, tmp_path, bags, robot):
    answer("export", *bags, "--to", "lerobot", "--out", tmp_path / "set")
    reported = json.loads(run_peer(pytestconfig.rootpath, SCRIPT, tmp_path / "set", home=tmp_path / "home"))
    opened = [open_bag(bag) for bag in bags]
    seen = [joint_vectors(bag.of(OBSERVATION), "position") for bag in opened]
    sent = [joint_vectors(bag.of(ACTION), "effort") for bag in opened]
    lengths = [len(each) for each in sent]
    observations, actions = (np.concatenate([each.values for each in every]) for every in (seen, sent))
    hz = load_robot(robot).timing.control_hz
    assert (reported["version"], reported["robot_type"], reported["fps"]) == ("v3.0", robot, hz)
    assert reported["names"]["observation.state"] == list(seen[0].names)
    assert reported["names"]["action"] == list(sent[0].names)
    assert reported["episodes"] == [[0, lengths[0]], [lengths[0], sum(lengths)]]
    frames = reported["frames"]
    assert len(frames) == sum(lengths)

    def column(name: str) -> np.ndarray:
        return np.array([frame[name] for frame in frames])

    np.testing.assert_array_equal(column("observation.state"), observations.astype(np.float32))
    np.testing.assert_array_equal(column("action"), actions.astype(np.float32))
    np.testing.assert_array_equal(column("index"), np.arange(sum(lengths)))
    steps = np.concatenate([np.arange(length) for length in lengths])
    np.testing.assert_array_equal(column("frame_index"), steps)
    np.testing.assert_allclose(column("timestamp"), steps / hz, rtol=1e-6)
    assert np.flatnonzero(column("next.done")).tolist() == [lengths[0] - 1, sum(lengths) - 1]
    assert len(set(column("task"))) == 1
    assert reported["task_index"] == 0
    # One episode alone, and windows of time that end where an episode does.
    assert reported["second"] == [lengths[1], lengths[0]]
    last = lengths[0] - 1
    np.testing.assert_array_equal(reported["ahead"], actions[[[0, 2], [last, last]]].astype(np.float32))
    assert reported["padded"] == [[False, False], [False, True]]
    np.testing.assert_allclose(reported["stats"]["mean"], actions.mean(axis=0), rtol=1e-6, atol=1e-7)
    np.testing.assert_allclose(
        reported["stats"]["q90"], np.quantile(actions, 0.9, axis=0), rtol=1e-6, atol=1e-7
    )


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_lerobot_shows_the_images_that_a_dataset_has_with_each_step(pytestconfig, tmp_path):
    bags = []
    for name, source in (("policy", POLICY), ("lqr", LQR)):
        messages = packed_messages(20, "/floating_platform", hz=5.0)
        bags.append(with_images(open_bag(source), tmp_path / name, messages, hz=5.0))
    answer("export", *bags, "--to", "lerobot", "--out", tmp_path / "set")
    reported = json.loads(run_peer(pytestconfig.rootpath, SCRIPT, tmp_path / "set", home=tmp_path / "home"))
    colour, depth, ids = (
        f"observation.images.{name}" for name in ("camera", "camera_depth", "camera_segmentation")
    )
    assert reported["video_keys"] == [colour]
    length = reported["episodes"][0][1]
    for place, index in enumerate(reported["looked_at"]):
        pixels = scene(min(index % length, 19))
        shade = np.array(reported["images"][colour][place]).transpose(1, 2, 0)
        assert np.abs(255.0 * shade - pixels[COLOUR]).mean() < 8.0
        np.testing.assert_array_equal(np.array(reported["images"][ids][place])[0], pixels[IDS])
        whole = np.array(reported["images"][depth][place])[0]
        there = np.isfinite(pixels[DEPTH])
        np.testing.assert_array_equal(whole > 0, there)
        np.testing.assert_allclose(whole[there], 1000.0 * pixels[DEPTH][there], rtol=1e-3, atol=0.5)
    assert np.shape(reported["image_stats"][colour]) == (3, 1, 1)
    assert 0.0 < np.max(reported["image_stats"][colour]) < 1.0


def layout_of(dataset: Path) -> dict[str, object]:
    """Files of a dataset with their columns and types, and what its `info.json` says of features and paths."""
    found: dict[str, object] = {}
    for path in sorted(dataset.rglob("*.parquet")):
        schema = parquet.read_schema(path)
        types = {field.name: str(field.type).replace("large_string", "string") for field in schema}
        found[str(path.relative_to(dataset))] = types
    info = json.loads((dataset / "meta/info.json").read_text())
    stats = json.loads((dataset / "meta/stats.json").read_text())
    reported = (
        "codebase_version",
        "chunks_size",
        "data_files_size_in_mb",
        "data_path",
        "video_path",
        "features",
        "fps",
    )
    return {
        **found,
        "info": sorted(info),
        "stats": {key: sorted(each) for key, each in stats.items()},
        **{key: info[key] for key in reported},
    }


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_an_exported_dataset_has_the_files_and_columns_that_lerobot_writes(pytestconfig, tmp_path):
    ours, theirs = tmp_path / "ours", tmp_path / "theirs"
    answer("export", POLICY, POLICY, "--to", "lerobot", "--out", ours)
    info = (ours / "meta/info.json").read_text()
    run_peer(
        pytestconfig.rootpath, SCRIPT.with_name("write_dataset.py"), theirs, info, home=tmp_path / "home"
    )
    assert layout_of(ours) == layout_of(theirs)


def test_where_the_peers_are_missing_a_test_fails_and_names_the_command(tmp_path):
    with pytest.raises(pytest.fail.Exception, match="Run: make peers"):
        run_peer(tmp_path, SCRIPT, home=tmp_path)


def test_a_script_that_fails_fails_its_test_with_what_it_said(tmp_path):
    python = tmp_path / ".venv-peers" / "bin" / "python"
    python.parent.mkdir(parents=True)
    python.write_text("#!/usr/bin/env bash\necho 'no module named lerobot' >&2; exit 1\n")
    python.chmod(0o755)
    with pytest.raises(pytest.fail.Exception, match="no module named lerobot"):
        run_peer(tmp_path, SCRIPT, home=tmp_path)
