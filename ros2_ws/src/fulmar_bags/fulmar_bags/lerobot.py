"""Bags as a dataset in the layout of LeRobot, version 3.0 of its format: many episodes in one parquet file.

Source: what LeRobot 0.4.4 writes; `tests/peers` loads our datasets with it. Each bag is one episode, each control step
one frame: what the controller received is `observation.state`, what it answered is `action`, and what cameras saw last
stands beside them, see `lerobot_images`.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from fulmar_bags.control_steps import ControlSteps
from fulmar_bags.figures import GAP, NS
from fulmar_bags.lerobot_images import (
    VIDEO_MB,
    VIDEO_PATH,
    Seen,
    Statistics,
    Videos,
    as_cells,
    check_alike,
    frames_at,
)
from fulmar_core.config.errors import BagError, ConfigError

VERSION = "v3.0"
CHUNK = 1000  # files of one folder
FILE_MB = 100  # an episode that would make a file of frames larger than this begins another one
FILE = "chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
DATA_PATH, EPISODES_PATH = f"data/{FILE}", f"meta/episodes/{FILE}"
INDICES = ("frame_index", "episode_index", "index", "task_index")
QUANTILES = {"q01": 0.01, "q10": 0.1, "q50": 0.5, "q90": 0.9, "q99": 0.99}

Columns = dict[str, np.ndarray]  # of one episode, by feature; the first axis is that of its frames
NO_CAMERA = Seen({})


def write_lerobot(
    records: Sequence[ControlSteps], titles: Sequence[str], folder: Path, seen: Sequence[Seen] = ()
) -> tuple[Path, list[str]]:
    """Write a dataset.

    Args:
        records: One for each bag, all of the same robot, observations and rate.
        titles: The task of each in words.
        folder: Absent or empty; is made.
        seen: The cameras of each bag, if any are to be taken along.

    Returns:
        The folder, and in words which bags gave several episodes (one with a hole gives one for each part), and which
        steps before the first image are left out.

    Raises:
        BagError: A bag holds no observations or actions, or is of another kind than the first.
        ConfigError: The folder holds something already.
        OSError: It cannot be written.
    """
    if folder.exists() and any(folder.iterdir()):
        raise ConfigError(f"{folder} is not empty, and datasets are never mixed. Name a new folder.")
    seen = seen or [NO_CAMERA] * len(records)
    parts = [_parts(record, each.begin_ns) for record, each in zip(records, seen, strict=True)]
    _check_alike(records)
    check_alike(seen)
    fps = records[0].settings.control_rate(records[0].robot)
    tasks = list(dict.fromkeys(titles))
    begin, episodes, named = 0, list[Columns](), list[str]()
    videos = {key: Videos(folder, key, fps) for key, each in seen[0].cameras.items() if each.kind == "colour"}
    sampled: list[dict[str, Statistics]] = []
    films: list[dict[str, Any]] = []
    for mine, title, each in zip(parts, titles, seen, strict=True):
        for part in mine:
            columns = _columns(part, fps, len(episodes), begin, tasks.index(title))
            film, samples = _add_images(columns, part, each, videos)
            episodes.append(columns)
            named.append(title)
            films.append(film)
            sampled.append(samples)
            begin += len(part.state)
    for video in videos.values():
        video.close()
    places = _write_frames(episodes, folder)
    rows = [
        _episode(columns, title, place) | film | _image_stats(samples)
        for columns, title, place, film, samples in zip(episodes, named, places, films, sampled, strict=True)
    ]
    _write(pa.Table.from_pylist(rows), folder / EPISODES_PATH.format(chunk_index=0, file_index=0))
    _write(_task_table(tasks), folder / "meta/tasks.parquet")
    every = {key: np.concatenate([columns[key] for columns in episodes]) for key in _numbers(episodes[0])}
    stats = {key: _stats(values) for key, values in every.items()} | _whole_image_stats(sampled)
    _write_json(folder / "meta/stats.json", stats)
    info = _info(records[0], fps, len(episodes), len(tasks), every)
    info["features"] |= seen[0].features(fps)
    info["video_path"] = VIDEO_PATH if videos else None
    _write_json(folder / "meta/info.json", info)
    return folder, _notes(records, parts, seen)


@dataclass(frozen=True)
class Part:
    """Steps of a bag that follow each other evenly: an episode."""

    state: np.ndarray  # (n, k)
    action: np.ndarray  # (n, m)
    stamp_ns: np.ndarray  # (n,) of the odometry that each answers


def _usable(record: ControlSteps) -> tuple[np.ndarray, np.ndarray]:
    """Steps with observation and action, shape (n,), and the actions (n, m)."""
    answers = record.actions if np.isfinite(record.actions).any() else record.commands
    return np.isfinite(record.observations).all(axis=1) & np.isfinite(answers).all(axis=1), answers


def _parts(record: ControlSteps, begin_ns: int) -> list[Part]:
    """Steps from a time on that have observation and action, apart where time does not go on evenly."""
    both, answers = _usable(record)
    if not record.observation_names or not both.any():
        raise BagError("the bag holds no observations with actions, which are the frames of such a dataset.")
    both &= record.stamp_ns >= begin_ns
    if not both.any():
        raise BagError("the bag holds no control step after the first image of each camera.")
    passed = np.diff(record.stamp_ns[both]) * record.settings.control_rate(record.robot) / NS
    ends = np.flatnonzero((passed <= 0.0) | (passed > GAP)) + 1
    columns = (np.split(values[both], ends) for values in (record.observations, answers, record.stamp_ns))
    return [Part(*each) for each in zip(*columns, strict=True)]


def _notes(
    records: Sequence[ControlSteps], parts: Sequence[Sequence[Part]], seen: Sequence[Seen]
) -> list[str]:
    notes = []
    for number, (record, mine, each) in enumerate(zip(records, parts, seen, strict=True), start=1):
        early = int(_usable(record)[0].sum()) - sum(len(part.state) for part in mine)
        if early:
            notes.append(f"bag {number}: {early} steps before the first image are left out.")
        if len(mine) > 1:
            notes.append(f"bag {number}: steps are missing; its {len(mine)} parts are episodes of their own.")
        notes += [f"bag {number}: left out: {note}" for note in each.notes]
    if any(camera.kind != "colour" for camera in seen[0].cameras.values()):
        notes.append(
            "depth is in millimetres up to 32.767 m, 0 is nothing; it and ids are PNG in the table, not video."
        )
    return notes


def _add_images(
    columns: Columns, part: Part, seen: Seen, videos: dict[str, Videos]
) -> tuple[dict[str, Any], dict[str, Statistics]]:
    """Add what the cameras saw in an episode to its columns, or to the videos; returns where, and samples."""
    film: dict[str, Any] = {}
    samples = {key: Statistics() for key in seen.cameras}
    for key, camera in seen.cameras.items():
        frames = frames_at(camera, part.stamp_ns, samples[key])
        if key in videos:
            film |= videos[key].add(frames)
        else:
            columns[key] = as_cells(frames)
    return film, samples


def _numbers(columns: Columns) -> list[str]:
    return [key for key, values in columns.items() if values.dtype != object]


def _image_stats(samples: dict[str, Statistics]) -> dict[str, Any]:
    found = {key: _of_samples([each]) for key, each in samples.items()}
    return {f"stats/{key}/{name}": value for key, each in found.items() for name, value in each.items()}


def _whole_image_stats(sampled: Sequence[dict[str, Statistics]]) -> dict[str, Any]:
    return {key: _of_samples([each[key] for each in sampled]) for key in sampled[0]}


def _of_samples(every: Sequence[Statistics]) -> dict[str, Any]:
    """Statistics of each channel in LeRobot's shape (channels, 1, 1), with the number of frames."""
    found = _stats(np.concatenate([each.table() for each in every]))
    shaped = {name: [[[value]] for value in values] for name, values in found.items() if name != "count"}
    return {**shaped, "count": [sum(each.count for each in every)]}


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


def _columns(part: Part, fps: float, number: int, begin: int, task: int) -> Columns:
    count = len(part.state)
    frame = np.arange(count, dtype=np.int64)
    return {
        "observation.state": part.state.astype(np.float32),
        "action": part.action.astype(np.float32),
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
    arrays: dict[str, Any] = {}
    for name, values in columns.items():
        if values.dtype == object:  # images
            cells = pa.array(values.tolist(), pa.binary()), pa.nulls(len(values), pa.string())
            arrays[name] = pa.StructArray.from_arrays(cells, names=["bytes", "path"])
            continue
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
            for key in _numbers(columns)
            for name, value in _stats(columns[key]).items()
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
        "video_files_size_in_mb": VIDEO_MB,
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
