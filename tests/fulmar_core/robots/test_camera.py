"""What a robot's file says of a camera."""

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import config_path
from fulmar_core.robots.robot_file import load_robot_file
from fulmar_core.robots.sensors.camera import CameraConfig
from fulmar_core.robots.urdf import body_frames
from fulmar_core.states.rotation import rotate, rotate_inverse

MOUNT = "mount: [0.1, 0.0, 0.2, 0.0, 0.0, 0.0, 1.0]"


def written(tmp_path, camera):
    """A spacecraft with a camera in its file."""
    lines = config_path("robots", "spacecraft_16").read_text(encoding="utf-8").splitlines()
    at = lines.index("sensors:") + 1
    path = tmp_path / "spacecraft_16.yaml"
    path.write_text("\n".join((*lines[:at], *([f"  camera: {camera}"] if camera else []), *lines[at:])))
    return path


def test_a_robot_has_a_camera_where_its_file_says_so(tmp_path):
    assert load_robot_file(written(tmp_path, "")).sensors.camera is None
    assert load_robot_file(written(tmp_path, "{}")).sensors.camera == CameraConfig()


def test_the_original_s_camera_goes_by_its_name(tmp_path):
    camera = load_robot_file(written(tmp_path, "rl_avist")).sensors.camera
    assert (camera.width, camera.height, camera.field_of_view, camera.far) == (64, 64, 100.4, 50.1)
    # SRB: focal length 5, aperture 12.
    assert camera.focal_px / camera.width == pytest.approx(5.0 / 12.0, abs=1e-3)


@pytest.mark.parametrize(
    ("camera", "words"),
    [
        ("rl_avits", "Did you mean 'rl_avist'?"),
        ("{widhth: 64}", "Did you mean 'width'?"),
        ("{width: 0}", "1 to 4096 px"),
        ("{height: 100000}", "1 to 4096 px"),
        ("{near: 5.0, far: 1.0}", "0 < near < far"),
        ("{field_of_view: 180.0}", "between 0 and 170 degrees"),
        ("{field_of_view: 1.57}", "Is it in rad?"),
        ("{rate_hz: 0.0}", "greater than 0"),
        ("{mount: [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]}", "unit quaternion x, y, z, w"),
    ],
)
def test_a_camera_that_cannot_be_is_refused_in_one_line(camera, words, tmp_path, caplog):
    path = written(tmp_path, camera)
    try:
        load_robot_file(path)
        said = caplog.text
    except ConfigError as error:
        said = str(error)
        assert said.startswith(f"{path}:") and "\n" not in said
    assert words in said


def test_the_middle_of_the_image_lies_ahead_of_the_mount_and_its_right_edge_at_half_the_field_of_view():
    turned = (0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5))  # looks to the left of the body
    camera = CameraConfig(mount=(0.1, 0.2, 0.3, *turned), field_of_view=60.0)
    pose = camera.optical_pose(np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]))
    assert pose[:3] == pytest.approx([1.1, 0.2, 0.3])
    assert rotate(pose[3:], np.array([0.0, 0.0, 1.0])) == pytest.approx([0.0, 1.0, 0.0])
    assert rotate(pose[3:], np.array([1.0, 0.0, 0.0])) == pytest.approx([1.0, 0.0, 0.0])
    assert rotate(pose[3:], np.array([0.0, 1.0, 0.0])) == pytest.approx([0.0, 0.0, -1.0])
    edge = np.array([np.tan(np.radians(30.0)), 0.0, 1.0])
    assert (camera.intrinsics @ edge)[:2] == pytest.approx([camera.width - 0.5, 0.5 * (camera.height - 1)])
    seen = rotate_inverse(pose[3:], np.array([1.1, 5.2, 0.3]) - pose[:3])
    assert seen == pytest.approx([0.0, 0.0, 5.0], abs=1e-12)


def test_frames_of_the_body_hold_those_of_the_camera(tmp_path):
    frames = {each.name: each for each in body_frames(load_robot_file(written(tmp_path, f"{{{MOUNT}}}")))}
    link, optical = frames["camera_link"], frames["camera_optical_frame"]
    assert link.position == optical.position == (0.1, 0.0, 0.2)
    ahead = rotate(np.array(optical.quat_xyzw), np.array([0.0, 0.0, 1.0]))
    assert ahead == pytest.approx(rotate(np.array(link.quat_xyzw), np.array([1.0, 0.0, 0.0])))
    alone = body_frames(load_robot_file(written(tmp_path, "")))
    assert "camera_link" not in {frame.name for frame in alone}
