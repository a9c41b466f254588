"""What belongs to robots of another space is refused in one line, before anything starts."""

from __future__ import annotations

import pytest


@pytest.mark.parametrize(
    ("command", "words"),
    [
        ("run spacecraft_16 --task go_to_pose --lockstep", "pushed in space. Did you mean 'go_to_pose_3d'?"),
        ("run floating_platform --task go_to_pose_3d", "over a floor or water. Did you mean 'go_to_pose'?"),
        ("evaluate spacecraft_16 go_to_pose", "pushed in space. Did you mean 'go_to_pose_3d'?"),
        (
            "evaluate spacecraft_16 push_block --controller lqr",
            "shows others, such as go_to_pose_3d.",
        ),
        (
            "evaluate floating_platform go_to_pose_3d",
            "'floating_platform' is one of the robots that are pushed",
        ),
        (
            "train spacecraft_16 go_to_position",
            "'spacecraft_16' is one of the bodies that are pushed in space",
        ),
        (
            "up mujoco_lqr --robot spacecraft_16 --controller external",
            "task 'go_to_pose' is for robots that are",
        ),
        (
            "goals --robot spacecraft_16 --pose 1,2",
            "moves in space: 3 (x,y,z) or 6 (x,y,z,roll,pitch,yaw) are needed",
        ),
        (
            "goals --robot floating_platform --pose 1,2,3,4,5,6",
            "moves in two dimensions: 2 (x,y) or 3 (x,y,deg) are needed",
        ),
        ("up mujoco_lqr --start 1,2,3,4,5,6", "--start = '1,2,3,4,5,6' has 6 numbers"),
    ],
)
def test_what_belongs_to_the_other_space_is_one_line_before_anything_starts(
    command, words, fulmar, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    code, _, err = fulmar(*command.split())
    assert code == 2
    assert words in err
    assert len(err.strip().splitlines()) == 1
    assert not list(tmp_path.iterdir())
