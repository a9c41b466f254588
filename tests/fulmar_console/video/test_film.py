"""Films of recorded runs: what is drawn of robots of each kind."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fulmar_console.video.film import FilmSettings, make_film
from fulmar_console.video.stage import SURROUNDINGS, build_stage
from fulmar_core.config.errors import ConfigError
from fulmar_core.config.paths import config_names
from fulmar_core.loop.robot_info import RobotSetup, robot_info, space_of
from fulmar_core.robots.look import Part
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task
from tests.robot_files import write_cuboid

BAGS = Path(__file__).parents[2] / "replay" / "bags"
STILL = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])


def record_of(name: str, task: str) -> dict[str, object]:
    """A robot as the page has it."""
    info = robot_info(load_robot(name), load_task(task), RobotSetup())
    return {"index": 0, "name": name, "color": "#42a5f5", "info": info}


def test_a_boat_stands_on_water_with_all_its_parts_and_turns_its_propellers() -> None:
    record = record_of("kingfisher", "go_to_position")
    stage = build_stage([record], [], (64, 48), 0.0)
    assert stage.ground == 0.0
    assert stage.model.ngeom == len(record["info"]["look"]) + 1  # type: ignore[index]
    assert not stage.model.geom_contype[1:].any()
    assert not stage.model.geom_conaffinity[1:].any()
    body = stage.movers[0][0].body
    before = stage.model.body_quat[body].copy()
    stage.place(0, STILL, np.array([1.0, 1.0]), 0.02)
    assert np.linalg.norm(stage.model.body_quat[body] - before) > 0.1


def test_a_mesh_is_drawn_as_it_is_and_not_as_its_box(tmp_path: Path) -> None:
    write_cuboid(tmp_path / "meshes" / "cuboid.stl", (0.4, 0.3, 0.2))
    mesh = Part("mesh", file=str(tmp_path / "meshes" / "cuboid.stl"), at=(0.0, 0.0, 1.0))
    robot = dataclasses.replace(load_robot("floating_platform"), look=(mesh,))
    info = robot_info(robot, load_task("go_to_pose"), RobotSetup())
    stage = build_stage([{"index": 0, "name": "drawn", "color": "#42a5f5", "info": info}], [], (64, 48), 0.0)
    assert stage.model.nmesh == 1
    assert stage.model.mesh_facenum.tolist() == [12]
    assert not stage.model.geom_contype[1:].any()


def test_a_platform_stands_on_a_floor_under_its_bearings() -> None:
    stage = build_stage([record_of("floating_platform", "go_to_pose")], [], (64, 48), 0.0)
    assert stage.ground is not None
    assert -0.25 < stage.ground < -0.2


def test_in_space_there_is_no_floor() -> None:
    assert build_stage([record_of("cubesat_8", "go_to_pose_3d")], [], (64, 48), 0.0).ground is None


def test_surfaces_stand_at_the_angle_of_their_command() -> None:
    stage = build_stage([record_of("cessna_182", "fly_hold")], [], (64, 48), 0.0)
    info = record_of("cessna_182", "fly_hold")["info"]
    shares = np.array([1.0 if each["name"] == "elevator" else 0.0 for each in info["actuators"]])  # type: ignore[index]
    for _ in range(3):  # an angle, and no speed: it does not go on turning
        stage.place(0, STILL, shares, 0.1)
    angles = sorted({round(abs(np.degrees(mover.angle)), 3) for mover in stage.movers[0] if mover.turns})
    assert angles == [0.0, 25.0]


@pytest.mark.slow
@pytest.mark.parametrize("name", config_names("robots"))
def test_each_shipped_robot_has_a_stage(name: str) -> None:
    robot = load_robot(name)
    assert space_of(robot) in SURROUNDINGS
    task = {
        "plane": "go_to_position",
        "water": "go_to_position",
        "flight": "fly_hold",
        "space": "go_to_pose_3d",
    }
    stage = build_stage([record_of(name, task.get(space_of(robot), "point"))], [], (64, 48), 0.0)
    assert stage.reach > 0.05


@pytest.mark.slow
@pytest.mark.parametrize(
    "bag", ["floating_platform_go_to_pose_lqr", "kingfisher_go_to_position_policy", "airship_v7_fly_hold_lqi"]
)
def test_a_film_of_a_bag_shows_a_robot_that_moves(tmp_path: Path, bag: str) -> None:
    path = tmp_path / "film.webp"
    settings = FilmSettings((160, 90), 4.0, 1.0, (0.0, 1.0))
    done: list[float] = []
    make_film([BAGS / bag], path, settings, lambda share, _words: done.append(share), force=False)
    with Image.open(path) as image:
        assert image.n_frames >= 2
        first = np.asarray(image.convert("RGB")).astype(int)
        image.seek(image.n_frames - 1)
        last = np.asarray(image.convert("RGB")).astype(int)
    assert first.std() > 5.0  # neither black nor one colour
    assert np.abs(first - last).max() > 10
    assert done[-1] == 1.0


@pytest.mark.slow
def test_a_span_behind_the_end_of_a_run_is_refused(tmp_path: Path) -> None:
    settings = FilmSettings((160, 90), 4.0, 1.0, (500.0, 501.0))
    with pytest.raises(ConfigError, match="--span begins at 500 s"):
        make_film(
            [BAGS / "floating_platform_go_to_pose_lqr"],
            tmp_path / "film.gif",
            settings,
            lambda *_: None,
            force=False,
        )
