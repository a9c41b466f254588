"""Robots made from one that they are like, from URDF and from MJCF, and what is not taken."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.look import Part
from fulmar_core.robots.robot_file import load_robot, load_robot_file
from fulmar_evaluation.new_robot.mjcf_reader import read_mjcf
from fulmar_evaluation.new_robot.new_robot import make_robot
from fulmar_evaluation.new_robot.settings import read_settings
from fulmar_evaluation.new_robot.sources import read_description
from fulmar_evaluation.new_robot.urdf_reader import read_urdf
from fulmar_evaluation.new_robot.written import check_new_name, write_robot
from fulmar_evaluation.robot_check import check_robot
from tests.robot_files import FOUR, TURTLE, rover_urdf, write_cuboid


def written(folder: Path, text: str, name: str = "robot.urdf") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def from_urdf(
    folder: Path, text: str, like: str, settings: tuple[str, ...] = (), names: tuple[str, ...] = ()
):
    return make_robot("mine", like, read_settings(settings), read_urdf(written(folder, text)), names)


def gaps_of(made) -> str:
    return "\n".join(map(str, made.gaps))


@pytest.mark.parametrize(
    "like", ["floating_platform", "kingfisher", "leatherback", "cubesat_wheels", "int_ball2"]
)
def test_a_robot_like_another_one_is_that_one(like):
    made, other = make_robot("mine", like), load_robot(like)
    assert vars(made.robot) | {"name": "", "title": ""} == vars(other) | {"name": "", "title": ""}
    assert any("fulmar check robot mine" in step for step in made.steps)


def test_each_value_of_the_file_has_its_unit_and_what_measures_it():
    text = make_robot("mine", "floating_platform", {"body.mass": 8.0}).text
    assert "mass: 8.0 # kg, as you set it; weigh it; `fulmar identify` measures it" in text
    assert "fulmar identify runs/mine --known mass=KG+-KG" in text
    assert "fulmar commission" in text


def test_spans_performance_and_limits_follow_from_a_body_that_is_set():
    other = load_robot("floating_platform")
    made = make_robot("mine", "floating_platform", read_settings(["body.mass=21.28"])).robot
    assert made.uncertainty.mass == pytest.approx([4.0 * each for each in other.uncertainty.mass])
    assert made.performance.top_speed == pytest.approx(0.5 * other.performance.top_speed)
    assert made.performance.turning_acceleration == pytest.approx(
        0.25 * other.performance.turning_acceleration
    )


def test_what_a_user_sets_counts_more_than_what_would_follow():
    settings = read_settings(["body.mass=6.0", "performance.top_speed=0.7"])
    assert make_robot("mine", "floating_platform", settings).robot.performance.top_speed == 0.7


def test_a_boat_of_twice_the_mass_lies_deeper_and_passes_its_check(tmp_path):
    made = make_robot("mine", "kingfisher", read_settings(["body.mass=70", "body.inertia=[6.4, 10.4, 16.0]"]))
    assert made.robot.hydrodynamics.hydrostatics.draught == pytest.approx(0.2128, rel=1e-3)
    path = tmp_path / "robots" / "mine.yaml"
    write_robot(made, path)
    assert check_robot(str(path)).problems == ()


def test_a_rover_is_taken_with_the_masses_of_all_links_about_its_axles(tmp_path):
    made = from_urdf(tmp_path, rover_urdf(), "turtlebot2")
    body, drive = made.robot.body, made.robot.actuators
    assert body.mass == pytest.approx(40.0)
    assert body.com[:2] == pytest.approx((-0.075, 0.0))
    # About the common middle: the box, its four wheels, and what their distances add.
    yaw = 2.0 + 4 * 0.02 + 30 * 0.025**2 + 10 * (0.075**2 + 0.25**2 + 0.28**2)
    assert body.inertia[2] == pytest.approx(yaw)
    assert drive.wheel_radius == pytest.approx(0.18)
    assert drive.track == pytest.approx(0.56)
    assert drive.max_wheel_speed == 6.0
    assert drive.wheel_force == pytest.approx(2 * 25 / 0.18)
    assert body.footprint == pytest.approx((0.9, 0.66), abs=1e-6)
    assert body.height == pytest.approx(0.375)  # from the floor to the top of the box


def test_what_was_not_taken_of_a_rover_is_listed_with_what_to_do(tmp_path):
    said = gaps_of(from_urdf(tmp_path, rover_urdf(), "turtlebot2"))
    assert "mesh package://rover_description/meshes/base.stl, which is not there; put the package" in said
    assert "4 driven wheels skid in turns" in said
    assert "the place of 'imu_link' was not read" in said
    assert "front_left_wheel_link" in said


def test_a_turtle_has_the_wheels_and_casters_of_its_file(tmp_path):
    robot = from_urdf(tmp_path, TURTLE, "turtlebot2").robot
    assert robot.body.mass == pytest.approx(2.8)
    assert robot.body.radius == pytest.approx(0.17)
    assert robot.actuators.wheel_radius == pytest.approx(0.04)
    assert robot.actuators.track == pytest.approx(0.24)
    assert robot.actuators.caster_x == pytest.approx(0.13)
    wheel = next(part for part in robot.look if part.size == (0.08, 0.02) and part.at[1] > 0.0)
    x, y, z, w = wheel.quat_xyzw
    assert np.abs(Rotation.from_quat([x, y, z, w]).as_matrix()[:, 2]) == pytest.approx(
        [0.0, 1.0, 0.0], abs=1e-6
    )


def test_four_thrusters_of_a_model_are_taken_with_their_forces(tmp_path):
    made = make_robot("mine", "floating_platform", {}, read_mjcf(written(tmp_path, FOUR, "four.xml")))
    robot = made.robot
    assert robot.body.mass == pytest.approx(7.0)
    assert robot.body.com[0] == pytest.approx(0.06 / 7.0)
    assert robot.body.radius == pytest.approx(0.3)
    assert robot.actuators.thrust == 0.8
    assert [push.name for push in robot.actuators.pushes] == ["jet_1", "jet_2", "jet_3", "jet_4"]
    turned = np.sqrt(0.5)
    assert robot.actuators.pushes[2].direction == pytest.approx((-turned, turned, 0.0))
    assert "hull.stl is not there" in gaps_of(made)


def test_the_robots_of_files_pass_their_check(tmp_path):
    for name, like, description in (
        ("rover", "turtlebot2", read_urdf(written(tmp_path, rover_urdf()))),
        ("turtle", "turtlebot2", read_urdf(written(tmp_path, TURTLE))),
        ("four", "floating_platform", read_mjcf(written(tmp_path, FOUR, "four.xml"))),
    ):
        path = tmp_path / "robots" / f"{name}.yaml"
        write_robot(make_robot(name, like, {}, description), path)
        assert check_robot(str(path)).problems == ()
        assert load_robot_file(path).name == name


def test_actuators_may_be_named_by_a_pattern(tmp_path):
    text = TURTLE.replace("left_wheel_joint", "motor_a").replace("right_wheel_joint", "motor_b")
    text = text.replace("left_wheel", "disc_a").replace("right_wheel", "disc_b")
    assert "no joints about y with 'wheel'" in gaps_of(from_urdf(tmp_path, text, "turtlebot2"))
    made = from_urdf(tmp_path, text, "turtlebot2", names=("motor_*",))
    assert made.robot.actuators.track == pytest.approx(0.24)
    with pytest.raises(ConfigError, match=r"no link, site or joint 'moter_a'. Did you mean 'motor_a'\?"):
        from_urdf(tmp_path, text, "turtlebot2", names=("moter_a",))


def test_a_urdf_without_inertia_is_refused_unless_it_is_given(tmp_path):
    bare = TURTLE
    for kind in ("0.02", "0.0001"):
        bare = bare.replace(f'ixx="{kind}"', 'ixx="0"').replace(f'iyy="{kind}"', 'iyy="0"')
    bare = (
        bare.replace('izz="0.03"', 'izz="0"')
        .replace('izz="0.0002"', 'izz="0"')
        .replace('xyz="0 0.12', 'xyz="0 0.0')
    )
    without = bare[: bare.index("<inertial>")] + bare[bare.index("</inertial>") + len("</inertial>") :]
    without = without.replace('mass value="0.2"', 'mass value="0"')
    with pytest.raises(
        ConfigError, match=r"robot.urdf: its links have no mass .*--set body.mass=KG --set 'body.inertia="
    ):
        from_urdf(tmp_path, without, "turtlebot2")
    settings = ("body.mass=2.5", "body.inertia=[0.02, 0.02, 0.03]")
    assert (
        from_urdf(tmp_path, without, "turtlebot2", settings, ("left_wheel", "right_wheel")).robot.body.mass
        == 2.5
    )
    massive = TURTLE.replace('mass value="0.2"', 'mass value="0"')
    for kind in ('ixx="0.02"', 'iyy="0.02"', 'izz="0.03"', 'ixx="0.0001"', 'iyy="0.0001"', 'izz="0.0002"'):
        massive = massive.replace(kind, f'{kind[:4]}"0"')
    with pytest.raises(ConfigError, match="its links have no inertia"):
        from_urdf(tmp_path, massive, "turtlebot2")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("no xml", ":1: no XML"),
        ("<sdf/>", "begins with <sdf>, and a URDF begins with <robot>"),
        ("<robot name='r'/>", "has no links"),
        ("<!DOCTYPE r [<!ENTITY a 'b'>]><robot/>", "declares a document type"),
        (
            "<robot xmlns:xacro='http://www.ros.org/wiki/xacro'><xacro:include filename='a'/></robot>",
            "is a xacro. Expand it first: xacro robot.urdf > robot.urdf",
        ),
        (
            TURTLE.replace('value="2.4"', 'value="heavy"'),
            "'mass' of link 'base_link' is 'heavy'; 1 finite numbers",
        ),
        (TURTLE.replace('value="2.4"', 'value="-2.4"'), "'mass' of link 'base_link' is -2.4 kg"),
        (TURTLE.replace('link="front_caster"', 'link="front_castor"'), "Did you mean 'front_caster'?"),
        (
            TURTLE.replace('type="fixed"', 'type="fxied"'),
            "joint 'front' has the type 'fxied'. Did you mean 'fixed'?",
        ),
        (
            TURTLE.replace('<link name="front_caster"/>', '<link name="front_caster"/><link name="stray"/>'),
            "no tree",
        ),
        (
            TURTLE.replace('<axis xyz="0 0 1"/>', '<axis xyz="0 0 0"/>'),
            "'axis' of joint 'left_wheel_joint' is zero",
        ),
    ],
)
def test_a_urdf_that_is_none_is_refused_in_one_line(tmp_path, text, said):
    with pytest.raises(ConfigError) as refused:
        read_urdf(written(tmp_path, text))
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("<mujoco><worldbody><bodi/></worldbody></mujoco>", "no MJCF: "),
        ("<mujoco><worldbody/></mujoco>", "has no body"),
        (FOUR.replace('<inertial pos="0.01 0 0.02" mass="6" diaginertia="0.2 0.2 0.25"/>', ""),
         "and the mass of body 'base' follows from it"),
    ],
)  # fmt: skip
def test_a_model_that_is_none_is_refused_in_one_line(tmp_path, text, said):
    with pytest.raises(ConfigError) as refused:
        read_mjcf(written(tmp_path, text, "four.xml"))
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_root_that_is_none_is_refused_with_the_nearest_name(tmp_path):
    with pytest.raises(ConfigError, match=r"no link 'base_lnk'. Did you mean 'base_link'\?"):
        read_urdf(written(tmp_path, TURTLE), "base_lnk")
    with pytest.raises(ConfigError, match=r"no body 'bas'"):
        read_mjcf(written(tmp_path, FOUR, "four.xml"), "bas")


def test_one_file_is_taken_and_a_root_belongs_to_it(tmp_path):
    with pytest.raises(ConfigError, match="exclude one another"):
        read_description(tmp_path / "a.urdf", tmp_path / "a.xml")
    with pytest.raises(ConfigError, match="--root"):
        read_description(None, None, "base")


@pytest.mark.parametrize(
    ("texts", "said"),
    [
        (["body.mass"], "must be KEY=VALUE"),
        (["body.mass=1", "body.mass=2"], "is given twice"),
        (["body.mass=[1"], "no YAML"),
        (["bodi.mass=1"], "unknown key 'bodi'. Did you mean 'body'?"),
        (["body.mas=1"], "unknown key"),
        (["body.mass=heavy"], "must be a number"),
        (["body.mass=-1"], "must be greater than 0"),
        (["actuators.nozzles.9.position=[0, 0, 0]"], "is not in the file"),
    ],
)
def test_a_setting_that_cannot_be_is_refused_in_one_line(texts, said):
    with pytest.raises(ConfigError) as refused:
        make_robot("mine", "floating_platform", read_settings(texts))
    assert said in str(refused.value)
    assert "/" not in str(refused.value).split("Did")[0].replace("kg·m²/", "")


def test_a_name_that_is_taken_is_refused_and_no_file_is_replaced(tmp_path):
    with pytest.raises(ConfigError, match="comes with a robot 'jetbot'"):
        check_new_name("jetbot", tmp_path)
    with pytest.raises(ConfigError, match="must begin with a small letter"):
        check_new_name("My Bot", tmp_path)
    path = check_new_name("mine", tmp_path)
    write_robot(make_robot("mine", "jetbot"), path)
    with pytest.raises(ConfigError, match="exists already"):
        check_new_name("mine", tmp_path)
    assert check_new_name("mine", tmp_path, replaces=True) == path


def test_a_mesh_gives_the_outline_of_a_body_without_shapes_that_touch(tmp_path):
    write_cuboid(tmp_path / "meshes" / "hull.stl", (400.0, 300.0, 200.0))
    text = TURTLE.replace("<collision>", "<!--").replace("</collision>", "-->")
    mesh = '<mesh filename="meshes/hull.stl" scale="0.001 0.001 0.001"/>'
    made = from_urdf(tmp_path, text.replace('<cylinder length="0.1" radius="0.17"/>', mesh), "turtlebot2")
    assert made.robot.body.footprint == pytest.approx((0.4, 0.3))
    assert "the outline is that of what is drawn" in gaps_of(made)


def test_meshes_are_copied_beside_the_robot_s_file_and_drawn_where_the_model_has_them(tmp_path):
    write_cuboid(tmp_path / "assets" / "hull.stl", (500.0, 400.0, 300.0))
    made = make_robot("mine", "floating_platform", {}, read_mjcf(written(tmp_path, FOUR, "four.xml")))
    path = tmp_path / "mine" / "robots" / "mine.yaml"
    write_robot(made, path)
    part = load_robot_file(path).look[0]
    assert Path(part.file) == (path.parent / "meshes" / "mine" / "hull.stl").resolve()
    assert Path(part.file).read_bytes() == (tmp_path / "assets" / "hull.stl").read_bytes()
    assert part.scale == (0.001, 0.001, 0.001)
    assert part.at == pytest.approx((0.0, 0.0, 0.1), abs=1e-5)
    assert part.rpy == pytest.approx((0.0, 0.0, 0.0), abs=1e-3)
    assert not made.gaps


def test_look_has_the_nearest_colours(tmp_path):
    made = make_robot("mine", "floating_platform", {}, read_mjcf(written(tmp_path, FOUR, "four.xml")))
    assert made.robot.look[-1] == Part("box", (0.1, 0.1, 0.2), (0.0, 0.0, 0.2), color="red")
