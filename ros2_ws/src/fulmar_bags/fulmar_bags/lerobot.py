"""Bags as a dataset in the layout of LeRobot, version 2.1 of its format: parquet by episode, meta data as JSON.

Source: `meta/info.json` of public datasets of that version. Each bag is one episode, each control step one frame: what
the controller was fed is `observation.state`, what it answered is `action`.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from fulmar_bags.control_steps import ControlSteps
from fulmar_bags.figures import GAP, NS
from fulmar_core.errors import BagError, ConfigError

VERSION = "v2.1"
CHUNK = 1000  # episodes of one folder
DATA_PATH = "data/chunk-{episode_chunk:03d}/episode_{episode_index:06d}.parquet"
INDICES = ("frame_index", "episode_index", "index", "task_index")


def write_lerobot(
    courses: Sequence[ControlSteps], titles: Sequence[str], folder: Path
) -> tuple[Path, list[str]]:
    """Write a dataset.

    Args:
        courses: One for each bag, all of the same robot, observations and rate.
        titles: The task of each in words.
        folder: Absent or empty; is made.

    Returns:
        The folder, and in words which bags gave several episodes: one with a hole gives one for each part.

    Raises:
        BagError: A bag holds no observations or actions, or is of another kind than the first.
        ConfigError: The folder holds something already.
        OSError: It cannot be written.
    """
    if folder.exists() and any(folder.iterdir()):
        raise ConfigError(f"{folder} is not empty, and datasets are never mixed. Name a new folder.")
    parts = [_frames(course) for course in courses]
    _check_alike(courses)
    fps = courses[0].settings.control_rate(courses[0].robot)
    tasks = list(dict.fromkeys(titles))
    meta = folder / "meta"
    meta.mkdir(parents=True, exist_ok=True)
    begin, episodes, stats = 0, [], []
    frames = [(part, title) for mine, title in zip(parts, titles, strict=True) for part in mine]
    for number, ((state, action), title) in enumerate(frames):
        columns = _columns(state, action, fps, number, begin, tasks.index(title))
        path = folder / DATA_PATH.format(episode_chunk=number // CHUNK, episode_index=number)
        path.parent.mkdir(parents=True, exist_ok=True)
        pq.write_table(_table(columns), path)
        episodes.append({"episode_index": number, "tasks": [title], "length": len(state)})
        stats.append(
            {"episode_index": number, "stats": {key: _stats(value) for key, value in columns.items()}}
        )
        begin += len(state)
    info = _info(courses[0], fps, len(frames), begin, len(tasks), frames[0][0])
    (meta / "info.json").write_text(json.dumps(info, indent=4) + "\n")
    _write_lines(meta / "tasks.jsonl", [{"task_index": i, "task": task} for i, task in enumerate(tasks)])
    _write_lines(meta / "episodes.jsonl", episodes)
    _write_lines(meta / "episodes_stats.jsonl", stats)
    split = [
        f"bag {number}: steps are missing; its {len(mine)} parts are episodes of their own."
        for number, mine in enumerate(parts, start=1)
        if len(mine) > 1
    ]
    return folder, split


def _frames(course: ControlSteps) -> list[tuple[np.ndarray, np.ndarray]]:
    """Observations (n, k) and actions (n, m) of the steps that have both, apart where time does not go on evenly."""
    answers = course.actions if np.isfinite(course.actions).any() else course.commands
    both = np.isfinite(course.observations).all(axis=1) & np.isfinite(answers).all(axis=1)
    if not course.observation_names or not both.any():
        raise BagError("the bag holds no observations with actions, which are the frames of such a dataset.")
    passed = np.diff(course.stamp_ns[both]) * course.settings.control_rate(course.robot) / NS
    ends = np.flatnonzero((passed <= 0.0) | (passed > GAP)) + 1
    return list(zip(np.split(course.observations[both], ends), np.split(answers[both], ends), strict=True))


def _check_alike(courses: Sequence[ControlSteps]) -> None:
    def kind(course: ControlSteps) -> tuple[Any, ...]:
        return course.robot.name, course.observation_names, course.settings.control_rate(course.robot)

    for number, course in enumerate(courses):
        if kind(course) != kind(courses[0]):
            raise BagError(
                f"bag {number + 1} is of '{course.robot.name}' with {len(course.observation_names)} terms at "
                f"{course.settings.control_rate(course.robot):g} Hz, the first one is of another kind. "
                "Export them apart."
            )


def _columns(
    state: np.ndarray, action: np.ndarray, fps: float, number: int, begin: int, task: int
) -> dict[str, np.ndarray]:
    count = len(state)
    frame = np.arange(count, dtype=np.int64)
    return {
        "observation.state": state.astype(np.float32),
        "action": action.astype(np.float32),
        "timestamp": (frame / fps).astype(np.float32),
        "next.done": frame == count - 1,
        "frame_index": frame,
        "episode_index": np.full(count, number, dtype=np.int64),
        "index": begin + frame,
        "task_index": np.full(count, task, dtype=np.int64),
    }


def _table(columns: dict[str, np.ndarray]) -> pa.Table:
    arrays = {}
    for name, values in columns.items():
        if values.ndim == 2:
            flat = pa.array(values.reshape(-1), type=pa.float32())
            arrays[name] = pa.FixedSizeListArray.from_arrays(flat, values.shape[1])
        else:
            arrays[name] = pa.array(values)
    return pa.table(arrays)


def _stats(values: np.ndarray) -> dict[str, list[float] | list[int] | list[bool]]:
    table = values.reshape(len(values), -1)
    numbers = table.astype(np.float64)
    low, high = table.min(axis=0).tolist(), table.max(axis=0).tolist()
    mean, std = numbers.mean(axis=0).tolist(), numbers.std(axis=0).tolist()
    return {"min": low, "max": high, "mean": mean, "std": std, "count": [len(table)]}


def _info(
    course: ControlSteps,
    fps: float,
    episodes: int,
    frames: int,
    tasks: int,
    shapes: tuple[np.ndarray, np.ndarray],
) -> dict[str, Any]:
    def vector(names: Sequence[str], width: int) -> dict[str, Any]:
        return {"dtype": "float32", "shape": [width], "names": list(names)}

    state, action = shapes
    index = {name: {"dtype": "int64", "shape": [1], "names": None} for name in INDICES}
    return {
        "codebase_version": VERSION,
        "robot_type": course.robot.name,
        "total_episodes": episodes,
        "total_frames": frames,
        "total_tasks": tasks,
        "total_videos": 0,
        "total_chunks": (episodes + CHUNK - 1) // CHUNK,
        "chunks_size": CHUNK,
        "fps": int(fps) if float(fps).is_integer() else fps,
        "splits": {"train": f"0:{episodes}"},
        "data_path": DATA_PATH,
        "video_path": None,
        "features": {
            "observation.state": vector(course.observation_names, state.shape[1]),
            "action": vector(course.robot.actuators.names, action.shape[1]),
            "timestamp": {"dtype": "float32", "shape": [1], "names": None},
            "next.done": {"dtype": "bool", "shape": [1], "names": None},
            **index,
        },
    }


def _write_lines(path: Path, lines: Sequence[dict[str, Any]]) -> None:
    path.write_text("".join(json.dumps(line) + "\n" for line in lines))
