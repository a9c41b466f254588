"""A run with a simulated camera, recorded: in lock step the bag has one image of each kind for each period.

What a recorder does with images alone is in `test_recorder_frames.py`.
"""

from __future__ import annotations

import numpy as np
import pytest

from fulmar_bags.contents import open_bag
from fulmar_bags.decode import stamps_ns
from fulmar_bags.frame_topics import cameras
from fulmar_core.robots.topics import CAMERA_COMPRESSED, CAMERA_INFO, PERIOD
from tests.ros.cli import fulmar, json_of

INSPECT = (
    "run cubesat_8 --task inspect --thing gateway --path circle --controller pd --camera --lockstep --seed 3"
)
DURATION_S = 4
LARGEST = 60_000  # bytes of all images of a period, which are 690 kB raw

pytestmark = pytest.mark.real_time  # four processes at full speed leave other tests no processor


@pytest.mark.slow
def test_a_bag_in_lock_step_has_each_image_of_each_period_once_and_small(ros_domain, tmp_path):
    words = (*INSPECT.split(), "--duration", str(DURATION_S), "--record", "bag", "--json")
    done = fulmar(*words, env=ros_domain.env, cwd=tmp_path)
    assert json_of(done.stdout)["failure"] is None, done.stderr
    bag = open_bag(tmp_path / "bag")
    assert not bag.warnings
    assert bag.recording["dropped"] == {}
    periods = np.unique(stamps_ns(bag.of(PERIOD)))
    assert len(periods) == 10 * DURATION_S
    topics = [bag.of(wire) for wire in (*CAMERA_COMPRESSED, CAMERA_INFO)]
    for topic in topics:
        np.testing.assert_array_equal(stamps_ns(topic), periods, err_msg=topic.name)
    assert sum(len(data) for topic in topics for data in topic.data) < LARGEST * len(periods)
    colour, depth, ids = cameras(bag.topics.values())
    for number in (0, len(periods) // 2, len(periods) - 1):
        seen = ids.frame(number).pixels > 0
        assert 0.01 < seen.mean() < 0.9
        np.testing.assert_array_equal(np.isfinite(depth.frame(number).pixels), seen)
        assert colour.frame(number).pixels[seen].mean() > colour.frame(number).pixels[~seen].mean()
