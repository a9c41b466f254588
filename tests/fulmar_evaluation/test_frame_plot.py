"""Reports show what cameras saw along the way, of Fulmar's bags and of others, and go on where frames are damaged."""

from __future__ import annotations

import re

import numpy as np
import pytest
from rosbags.rosbag2.enums import StoragePlugin

from fulmar_bags.contents import open_bag
from fulmar_bags.frame_messages import COMPRESSED, IMAGE
from fulmar_bags.run_record import read_any_run
from fulmar_evaluation.report.bag_report import write_bag_report
from fulmar_evaluation.report.frame_plot import COLUMNS, frame_plot, strip_of
from fulmar_evaluation.report.run_report import write_report
from fulmar_evaluation.report.style import as_svg, house_style
from tests.bags_with_frames import packed_messages, theirs, with_images
from tests.foreign_bag import write_foreign
from tests.frames import COLOUR, NS, compressed, raw, scene
from tests.fulmar_cli.bag_commands import LQR


def shown(page):
    """Images, and texts in the figures of a page."""
    text = page.read_text()
    return len(re.findall(r'<image [^>]*href="data:image/png', text)), re.findall(r"<text[^>]*>([^<]*)", text)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    return with_images(open_bag(LQR), folder / "bag", packed_messages(12, "/floating_platform"))


def test_a_report_has_frames_of_each_kind_with_their_times_and_places(run, tmp_path):
    record = read_any_run(run)
    images, texts = shown(write_report([record], tmp_path / "report.html"))
    assert images == 3 * COLUMNS
    assert "What the camera saw" in (tmp_path / "report.html").read_text()
    assert "0.0 s" in texts
    x, y, z = record.motion.position[0]
    assert f"{x:.2f}, {y:.2f}, {z:.2f} m" in texts
    assert {"colour", "depth", "segmentation"} <= set(texts)


@pytest.mark.slow
def test_the_sheets_of_runs_and_of_bags_have_the_frames_too(run, tmp_path):
    sheet = tmp_path / "sheet.png"
    sizes = []
    for folder in (LQR, run):
        write_report([read_any_run(folder)], sheet)
        sizes.append(sheet.stat().st_size)
        write_bag_report(open_bag(folder), sheet)
        sizes.append(sheet.stat().st_size)
    assert sizes[2] > sizes[0]
    assert sizes[3] > sizes[1]


def test_the_frames_of_two_runs_are_shown_below_the_name_of_each(run):
    strip = strip_of(read_any_run(run).images, np.zeros(0), np.zeros((0, 3)))
    with house_style():
        page = as_svg(frame_plot([("first", strip), ("second", strip)]).figure)
    assert page.count("data:image/png") == 6 * COLUMNS
    assert ">first</text>" in page
    assert ">second</text>" in page


def test_the_report_of_a_bag_of_others_shows_their_images_and_names_what_it_cannot_show(tmp_path):
    source = open_bag(write_foreign(tmp_path / "theirs", StoragePlugin.MCAP, count=100))
    bag = open_bag(with_images(source, tmp_path / "bag", theirs()))
    page = write_bag_report(bag, tmp_path / "report.html")
    assert shown(page)[0] == 2 * COLUMNS
    assert "Not shown: /rear/image_raw: encoding &#x27;bayer_rggb8&#x27;" in page.read_text()


def test_a_damaged_frame_leaves_its_place_empty(tmp_path):
    colours = packed_messages(6)[f"/robot/{COLOUR}/compressed"][1]
    colours[-1] = compressed(b"torn", "jpeg", 1.5)
    source = open_bag(write_foreign(tmp_path / "theirs", StoragePlugin.MCAP, count=100))
    bag = with_images(source, tmp_path / "bag", {"/it": (COMPRESSED, colours)})
    images, texts = shown(write_bag_report(open_bag(bag), tmp_path / "report.html"))
    assert (images, texts.count("damaged")) == (COLUMNS - 1, 1)


def test_frames_without_stamps_have_times_of_their_own_and_no_place():
    from fulmar_bags.gathered import Topic

    data = [raw(scene()[COLOUR], "rgb8", 0.0)] * 3
    topic = Topic("/it", IMAGE, data, [1, NS + 1, 2 * NS + 1], [0] * 3, [0] * 3)
    strip = strip_of([topic], np.array([100.0, 200.0]), np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]))
    assert strip.time_ns[-1] - strip.begin_ns == 2 * NS
    assert np.isnan(strip.places).all()


def test_a_bag_without_images_has_no_strip():
    assert strip_of(tuple(open_bag(LQR).topics.values()), np.zeros(0), np.zeros((0, 3))) is None
