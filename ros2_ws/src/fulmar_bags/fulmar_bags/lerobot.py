"""Bags as a dataset in the layout of LeRobot, version 3.0 of its format: many episodes in one parquet file.

Source: what LeRobot 0.4.4 writes; `tests/peers` loads our datasets with it. Each bag is one episode, each control step
one frame: what the controller received is `observation.state`, what it answered is `action`.
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
from fulmar_core.config.errors import BagError, ConfigError

VERSION = "v3.0"
CHUNK = 1000  # files of one folder
FILE_MB = 100  # an episode that would make a file of frames larger than this begins another one
FILE = "chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
DATA_PATH, EPISODES_PATH = f"data/{FILE}", f"meta/episodes/{FILE}"
INDICES = ("frame_index", "episode_index", "index", "task_index")
QUANTILES = {"q01": 0.01, "q10": 0.1, "q50": 0.5, "q90": 0.9, "q99": 0.99}

Columns = dict[str, np.ndarray]  # of one episode, by feature; the first axis is that of its frames


def write_lerobot(
    records: Sequence[ControlSteps], titles: Sequence[str], folder: Path
) -> tuple[Path, list[str]]:
    """Write a dataset.

    Args:
        records: One for each bag, all of the same robot, observations and rate.
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
    parts = [_frames(record) for record in records]
    _check_alike(records)
    fps = records[0].settings.control_rate(records[0].robot)
    tasks = list(dict.fromkeys(titles))
    begin, episodes, named = 0, list[Columns](), list[str]()
    for mine, title in zip(parts, titles, strict=True):
        for state, action in mine:
            episodes.append(_columns(state, action, fps, len(episodes), begin, tasks.index(title)))
            named.append(title)
            begin += len(state)
    places = _write_frames(episodes, folder)
    rows = [
        _episode(columns, title, place) for columns, title, place in zip(episodes, named, places, strict=True)
    ]
    _write(pa.Table.from_pylist(rows), folder / EPISODES_PATH.format(chunk_index=0, file_index=0))
    _write(_task_table(tasks), folder / "meta/tasks.parquet")
    every = {key: np.concatenate([columns[key] for columns in episodes]) for key in episodes[0]}
    _write_json(folder / "meta/stats.json", {key: _stats(values) for key, values in every.items()})
    _write_json(folder / "meta/info.json", _info(records[0], fps, len(episodes), len(tasks), every))
    split = [
        f"bag {number}: steps are missing; its {len(mine)} parts are episodes of their own."
        for number, mine in enumerate(parts, start=1)
        if len(mine) > 1
    ]
    return folder, split


def _frames(record: ControlSteps) -> list[tuple[np.ndarray, np.ndarray]]:
    """Observations (n, k) and actions (n, m) of the steps that have both, apart where time does not go on evenly."""
    answers = record.actions if np.isfinite(record.actions).any() else record.commands
    both = np.isfinite(record.observations).all(axis=1) & np.isfinite(answers).all(axis=1)
    if not record.observation_names or not both.any():
        raise BagError("the bag holds no observations with actions, which are the frames of such a dataset.")
    passed = np.diff(record.stamp_ns[both]) * record.settings.control_rate(record.robot) / NS
    ends = np.flatnonzero((passed <= 0.0) | (passed > GAP)) + 1
    return list(zip(np.split(record.observations[both], ends), np.split(answers[both], ends), strict=True))


def _check_alike(records: Sequence[ControlSteps]) -> None:
    def kind(record: ControlSteps) -> tuple[Any, ...]:
        rate = record.settings.control_rate(record.robot)
        return record.robot.name, record.robot.actuators.names, record.observation_names, rate

    for number, record in enumerate(records):
        if kind(record) != kind(records[0]):
            raise BagError(
                f"bag {number + 1} is of '{record.robot.name}' with {len(record.observation_names)} terms at "
                f"{record.settings.control_rate(record.robot):g} Hz, the first one is of another kind. "
                "Export them apart."
            )


def _columns(
    state: np.ndarray, action: np.ndarray, fps: float, number: int, begin: int, task: int
) -> Columns:
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


def _write_frames(episodes: Sequence[Columns], folder: Path) -> list[tuple[int, int]]:
    """Write the frames of all episodes, and say the chunk and the file that hold each of them."""
    files: list[list[pa.Table]] = [[]]
    size, places = 0, []
    for columns in episodes:
        table = _table(columns)
        if files[-1] and size + table.nbytes > FILE_MB << 20:
            files.append([])
            size = 0
        files[-1].append(table)
        size += table.nbytes
        places.append(divmod(len(files) - 1, CHUNK))
    for (chunk, file), tables in zip(sorted(set(places)), files, strict=True):
        path = folder / DATA_PATH.format(chunk_index=chunk, file_index=file)
        _write(pa.concat_tables(tables), path)
    return places


def _table(columns: Columns) -> pa.Table:
    """Frames as LeRobot types them: a vector is a list of fixed size, a feature of one number is that number."""
    arrays = {}
    for name, values in columns.items():
        flat = pa.array(values.reshape(-1))
        wide = values.ndim == 2 and values.shape[1] > 1
        arrays[name] = pa.FixedSizeListArray.from_arrays(flat, values.shape[1]) if wide else flat
    return pa.table(arrays)


def _episode(columns: Columns, title: str, place: tuple[int, int]) -> dict[str, Any]:
    """What the table of episodes says about one of them."""
    index = columns["index"]
    return {
        "episode_index": int(columns["episode_index"][0]),
        "tasks": [title],
        "length": len(index),
        "data/chunk_index": place[0],
        "data/file_index": place[1],
        "dataset_from_index": int(index[0]),
        "dataset_to_index": int(index[-1]) + 1,
        **{
            f"stats/{key}/{name}": value
            for key, values in columns.items()
            for name, value in _stats(values).items()
        },
        "meta/episodes/chunk_index": 0,
        "meta/episodes/file_index": 0,
    }


def _task_table(tasks: Sequence[str]) -> pa.Table:
    """Tasks as pandas writes a frame whose index is the text of each, which is where LeRobot looks for it."""
    index = "__index_level_0__"  # what pandas calls an index without a name
    table = pa.table({"task_index": np.arange(len(tasks), dtype=np.int64), index: list(tasks)})
    kinds = [("task_index", "task_index", "int64", "int64"), (None, index, "unicode", "object")]
    columns = [
        {"name": name, "field_name": field, "pandas_type": kind, "numpy_type": dtype, "metadata": None}
        for name, field, kind, dtype in kinds
    ]
    about = {"index_columns": [index], "column_indexes": [], "columns": columns}
    return table.replace_schema_metadata({"pandas": json.dumps(about)})


def _stats(values: np.ndarray) -> dict[str, list[float] | list[int] | list[bool]]:
    table = values.reshape(len(values), -1)
    numbers = table.astype(np.float64)
    low, high = table.min(axis=0).tolist(), table.max(axis=0).tolist()
    mean, std = numbers.mean(axis=0).tolist(), numbers.std(axis=0).tolist()
    quantiles = {name: np.quantile(numbers, share, axis=0).tolist() for name, share in QUANTILES.items()}
    return {"min": low, "max": high, "mean": mean, "std": std, "count": [len(table)], **quantiles}


def _info(record: ControlSteps, fps: float, episodes: int, tasks: int, frames: Columns) -> dict[str, Any]:
    def feature(dtype: str, width: int = 1, names: Sequence[str] | None = None) -> dict[str, Any]:
        return {"dtype": dtype, "shape": [width], "names": None if names is None else list(names)}

    state, action = frames["observation.state"], frames["action"]
    return {
        "codebase_version": VERSION,
        "robot_type": record.robot.name,
        "total_episodes": episodes,
        "total_frames": len(state),
        "total_tasks": tasks,
        "chunks_size": CHUNK,
        "data_files_size_in_mb": FILE_MB,
        "video_files_size_in_mb": 200,  # there are none, but readers ask for it
        "fps": int(fps) if float(fps).is_integer() else fps,
        "splits": {"train": f"0:{episodes}"},
        "data_path": DATA_PATH,
        "video_path": None,
        "features": {
            "observation.state": feature("float32", state.shape[1], record.observation_names),
            "action": feature("float32", action.shape[1], record.robot.actuators.names),
            "timestamp": feature("float32"),
            "next.done": feature("bool"),
            **{name: feature("int64") for name in INDICES},
        },
    }


def _write(table: pa.Table, path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    pq.write_table(table, path)


def _write_json(path: Path, value: dict[str, Any]) -> None:
    path.write_text(json.dumps(value, indent=4) + "\n")
