"""Recordings of event cameras, and the turn rates that `fulmar rates` finds in them.

`stars.aedat4` holds 0.6 s of simulated stars in a camera of 320 × 240 pixels and 8.5° that turns with 0.4, -0.3 and
0.2 °/s; dv-processing 2.0.4, which shares no code with our reader, wrote it.
"""

from __future__ import annotations

import json
import os
from pathlib import Path
from types import SimpleNamespace

import h5py
import hdf5plugin
import numpy as np
import pytest
from typer.testing import CliRunner

from fulmar_bags.contents import open_bag
from fulmar_bags.event_files import EventFile, open_event_file
from fulmar_bags.event_packets import events_of_cloud
from fulmar_bags.wire_reader import WireReader
from fulmar_cli.main import app
from fulmar_core.config.errors import BagError, ConfigError
from fulmar_core.dynamics.sky.events import Events, joined
from fulmar_core.estimators.kinds import load_estimator
from fulmar_core.robots.topics import EVENTS
from tests.fulmar_cli.bag_commands import POLICY

AEDAT4 = Path(__file__).parents[1] / "fulmar_bags" / "event_files" / "stars.aedat4"
TURNED = np.array([0.4, -0.3, 0.2])  # °/s
SIZE = (320, 240)
OFFSET_US = 54_321_000_000


def fulmar(*arguments, cwd: Path):
    """Run a command to its end, in this process."""
    before = Path.cwd()
    os.chdir(cwd)
    try:
        done = CliRunner().invoke(app, list(map(str, arguments)))
    finally:
        os.chdir(before)
    refused = "" if done.exception is None else str(done.exception)
    error = done.stderr + refused
    return SimpleNamespace(returncode=done.exit_code, stdout=done.stdout, stderr=error, error=done.exception)


def whole(file: EventFile) -> Events:
    return joined([events for _, events in file.packets(0.05)])


@pytest.fixture(scope="module")
def recorded() -> Events:
    """Events of the recording."""
    return whole(open_event_file(AEDAT4))


def write_dsec(path: Path, events: Events, **changes) -> Path:
    """In the layout of DSEC, with arrays of it replaced, or left out where they are None."""
    begin = int(events.t[0]) // 1000
    t = events.t.astype(np.int64) // 1000 - begin
    arrays = {"x": events.x, "y": events.y, "t": t.astype(np.uint32), "p": events.p} | changes
    with h5py.File(path, "w") as file:
        for name, values in arrays.items():
            if values is not None:
                file.create_dataset(f"events/{name}", data=values, **hdf5plugin.Blosc(cname="zstd"))
        file["t_offset"] = np.int64(OFFSET_US)
        file["ms_to_idx"] = np.searchsorted(t, np.arange(0, t[-1], 1000)).astype(np.uint64)
    return path


@pytest.fixture
def dsec(tmp_path, recorded):
    return write_dsec(tmp_path / "stars.h5", recorded)


def test_a_file_of_inivation_is_read_with_its_size(recorded):
    assert (recorded.width, recorded.height) == SIZE
    assert len(recorded) == 11_546
    assert recorded.problem() == ""
    assert set(recorded.p.tolist()) == {0, 1}


def test_a_file_of_dsec_has_the_events_that_were_written_with_its_offset(dsec, recorded):
    found = whole(open_event_file(dsec, SIZE))
    for name in ("x", "y", "p"):
        np.testing.assert_array_equal(getattr(found, name), getattr(recorded, name))
    np.testing.assert_array_equal(found.t - found.t[0], recorded.t - recorded.t[0])
    assert int(found.t[0]) == OFFSET_US * 1000


def test_packets_follow_one_another_and_silence_gives_empty_ones_but_not_for_long(tmp_path, recorded):
    t = np.array(
        [0, 10, 260_000, 90_000_000]
    )  # µs: a gap of a quarter of a second, and one of a minute and a half
    some = Events(*(np.zeros(4, dtype=np.uint16),) * 2, recorded.t[:4], np.ones(4, dtype=np.uint8), *SIZE)
    file = open_event_file(write_dsec(tmp_path / "gaps.h5", some, t=t.astype(np.uint32)), SIZE)
    packets = list(file.packets(0.05))
    ends = (np.array([end for end, _ in packets]) - packets[0][0]) / 1e9
    np.testing.assert_allclose(ends, [0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 90.0], atol=1e-9)
    assert [len(events) for _, events in packets] == [2, 0, 0, 0, 0, 1, 1]


@pytest.mark.parametrize("ending", ["aedat4", "h5", "bag"])
def test_the_rate_is_that_of_the_stars_from_every_kind_of_source(ending, dsec, tmp_path):
    source = {"aedat4": AEDAT4, "h5": dsec, "bag": tmp_path / "bag"}[ending]
    if ending == "bag":
        done = fulmar("rates", AEDAT4, "--to-bag", source, "--json", cwd=tmp_path)
        assert done.returncode == 0, done.stderr
    size = ("--size", "320x240") if ending == "h5" else ()
    done = fulmar("rates", source, *size, "--plot", "rates.png", "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["windows"] == len(found["rates"]) == 3
    for each in found["rates"]:
        off = np.abs(np.array(each["deg_s"]) - TURNED) / np.array(each["std_deg_s"])
        assert off.max() < 4.0
    assert np.abs(np.array(found["mean_deg_s"]) - TURNED)[:2].max() < 0.01
    assert (tmp_path / "rates.png").stat().st_size > 10_000


def test_a_bag_of_a_recording_has_its_packets_on_the_wire_of_a_live_camera(tmp_path, recorded):
    done = fulmar("rates", AEDAT4, "--to-bag", "bag", cwd=tmp_path)
    assert "fulmar bag play" in done.stderr
    found = [events_of_cloud(each)[0] for _, each in WireReader(open_bag(tmp_path / "bag")).messages(EVENTS)]
    for name in ("x", "y", "t", "p"):
        np.testing.assert_array_equal(
            np.concatenate([getattr(each, name) for each in found]), getattr(recorded, name)
        )


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"p": None}, "'events/p' is missing"),
        ({"x": np.zeros(3, dtype=np.uint16)}, "have lengths"),
        ({"x": np.full(11_546, 500, dtype=np.uint16)}, "of another size than 320 × 240"),
        ({"t": np.arange(11_546, 0, -1, dtype=np.uint32)}, "not in the order of time"),
    ],
)
def test_a_file_that_cannot_be_is_refused_in_words(tmp_path, recorded, changes, says):
    path = write_dsec(tmp_path / "wrong.h5", recorded, **changes)
    with pytest.raises(BagError, match=says):
        whole(open_event_file(path, SIZE))


def test_truncated_files_and_files_of_other_kinds_are_refused_in_words(tmp_path, dsec):
    for source, kind in ((AEDAT4, "damaged|AEDAT4"), (dsec, "HDF5")):
        cut = tmp_path / f"cut{source.suffix}"
        cut.write_bytes(source.read_bytes()[: source.stat().st_size // 2])
        with pytest.raises(BagError, match=kind):
            whole(open_event_file(cut, SIZE if source is dsec else None))
    text = tmp_path / "text.aedat4"
    text.write_text("no events")
    with pytest.raises(BagError, match="cannot be read as AEDAT4"):
        open_event_file(text)
    with pytest.raises(BagError, match="no such file"):
        open_event_file(tmp_path / "none.h5")
    with pytest.raises(BagError, match=r"end in \.h5"):
        open_event_file(Path(__file__))


def test_the_size_of_a_camera_is_asked_for_and_checked(dsec):
    with pytest.raises(ConfigError, match="--size 640x480"):
        open_event_file(dsec)
    with pytest.raises(ConfigError, match="320 × 240 pixels, not 9 × 9"):
        open_event_file(AEDAT4, (9, 9))


def test_a_bag_without_events_and_a_robot_without_cameras_are_refused_in_words(tmp_path):
    done = fulmar("rates", POLICY, cwd=tmp_path)
    assert done.returncode != 0 and "no packet on 'events'" in done.stderr
    done = fulmar("rates", AEDAT4, "--robot", "floating_platform", cwd=tmp_path)
    assert done.returncode != 0 and "has no event camera" in done.stderr
    done = fulmar("rates", AEDAT4, "--size", "big", cwd=tmp_path)
    assert done.returncode != 0 and "two numbers of pixels" in done.stderr
    done = fulmar("rates", AEDAT4, AEDAT4, AEDAT4, cwd=tmp_path)
    assert done.returncode != 0 and "has 2 event cameras" in done.stderr


@pytest.mark.parametrize("kind", [np.int8, np.uint8, np.int64, np.uint32])
def test_minus_one_stands_for_darker_in_integers_of_any_kind(kind, tmp_path, recorded):
    with np.errstate(all="ignore"):
        p = np.where(recorded.p > 0, 1, -1).astype(np.int64).astype(kind)
    found = whole(open_event_file(write_dsec(tmp_path / "pm.h5", recorded, p=p), SIZE))
    np.testing.assert_array_equal(found.p, recorded.p)


@pytest.mark.parametrize(
    ("name", "change", "said"),
    [
        ("p", lambda p: 2 * p, "p reaches from 0 to 2, must lie in 0 to 1"),
        ("x", lambda x: x.astype(np.int32) + 65536, "x reaches from 65"),
        ("y", lambda y: y.astype(np.int32) - 300, "y reaches from -"),
        ("t", lambda t: t * 1e-6, "'events/t' is float64 of shape"),
        ("p", lambda p: np.stack([p, p]), "'events/p' is uint8 of shape (2, "),
    ],
)
def test_numbers_that_no_event_has_are_refused_in_one_line(name, change, said, tmp_path, recorded):
    begin = int(recorded.t[0]) // 1000
    arrays = {
        "x": recorded.x,
        "y": recorded.y,
        "t": (recorded.t.astype(np.int64) // 1000 - begin),
        "p": recorded.p,
    }
    path = write_dsec(tmp_path / "odd.h5", recorded, **{name: change(arrays[name])})
    done = fulmar("rates", path, "--size", "320x240", cwd=tmp_path)
    assert done.returncode != 0
    assert said in done.stderr
    assert isinstance(done.error, BagError)


def test_a_table_of_columns_is_refused_by_its_layout(tmp_path):
    with h5py.File(tmp_path / "columns.h5", "w") as file:
        file["events"] = np.zeros((10, 4))
    with pytest.raises(BagError, match="'events' is one table of columns"):
        open_event_file(tmp_path / "columns.h5", SIZE)


@pytest.mark.parametrize("offset", [np.zeros(3, dtype=np.int64), 0.5])
def test_an_offset_that_is_no_whole_number_is_refused(offset, dsec):
    with h5py.File(dsec, "r+") as file:
        del file["t_offset"]
        file["t_offset"] = offset
    with pytest.raises(BagError, match="'t_offset' must be one whole number"):
        open_event_file(dsec, SIZE)


@pytest.mark.parametrize("later_us", [3_600_000_000, 2_000_000])
def test_recordings_that_do_not_overlap_in_time_are_refused(later_us, dsec, tmp_path, recorded):
    right = write_dsec(tmp_path / "right.h5", recorded)
    with h5py.File(right, "r+") as file:
        file["t_offset"][()] = OFFSET_US + later_us
    done = fulmar("rates", dsec, right, "--size", "320x240", cwd=tmp_path)
    assert isinstance(done.error, BagError)
    assert "do not overlap in time: 'events' ends" in done.stderr


def test_times_count_from_the_first_event_and_the_length_has_every_packet(tmp_path, recorded):
    said = json.loads(fulmar("rates", AEDAT4, "--fov", 8.5, "--json", cwd=tmp_path).stdout)
    lasts = int(recorded.t[-1] - recorded.t[0]) / 1e9
    assert lasts <= said["seconds"] < lasts + 0.05
    window = load_estimator("event_rate").window_s
    assert said["rates"][0]["t_s"] == pytest.approx(0.5 * window, abs=0.025)


def test_a_bag_has_the_times_of_its_recording(tmp_path):
    kept = fulmar("rates", AEDAT4, "--fov", 8.5, "--to-bag", "night", "--json", cwd=tmp_path)
    again = fulmar("rates", "night", "--fov", 8.5, "--json", cwd=tmp_path)
    first, second = json.loads(kept.stdout), json.loads(again.stdout)
    assert first["seconds"] == second["seconds"]
    assert [rate["t_s"] for rate in first["rates"]] == [rate["t_s"] for rate in second["rates"]]
