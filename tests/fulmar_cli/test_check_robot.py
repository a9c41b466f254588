"""`fulmar check robot`: each family passes, and mistakes get one line each."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import yaml

from fulmar_core.config.paths import OWN_FOLDERS, config_names, config_path
from fulmar_core.robots.robot_file import load_robot
from fulmar_evaluation import wrench_limits
from tests import new_robots, wrong_robots
from tests.fulmar_cli.command_line import complaint

NEW = Path(new_robots.__file__).parent
KEYS = {
    "robot", "actuators", "wrench", "zero_wrench_holdable", "controllable", "least_time", "trim", "tried", "passed",
    "problems", "warnings",
}  # fmt: skip


def checked(fulmar, name):
    """Exit code, and the JSON object."""
    code, out, _ = fulmar("check", "robot", str(name), "--json")
    return code, json.loads(out)


def altered(tmp_path, name="spacecraft_16", **changes):
    """A copy of a shipped robot with other values; keys are dotted with two underscores."""
    robot = yaml.safe_load(config_path("robots", name).read_text(encoding="utf-8"))
    for key, value in changes.items():
        *parts, last = key.split("__")
        inner = robot
        for part in parts:
            inner = inner[part]
        inner[last] = value
    path = tmp_path / f"{name}.yaml"
    path.write_text(yaml.safe_dump(robot, allow_unicode=True), encoding="utf-8")
    return path


@pytest.mark.parametrize("name", config_names("robots"))
def test_every_shipped_robot_passes(fulmar, name):
    code, found = checked(fulmar, name)
    assert (code, found["passed"], found["problems"], found["warnings"]) == (0, True, [], [])
    assert set(found) == KEYS
    assert found["robot"] == name
    assert found["controllable"]
    assert found["zero_wrench_holdable"]
    assert bool(found["trim"]) is load_robot(name).flies


@pytest.mark.parametrize("name", ["courier", "fan_disc", "lopsided_probe", "raft", "rally", "skiff"])
def test_a_file_is_checked_without_being_installed(fulmar, name):
    code, found = checked(fulmar, NEW / f"{name}.yaml")
    assert (code, found["robot"], found["problems"]) == (0, name, [])


def test_int_ball2_has_the_published_limits_and_times(fulmar):
    """`facts`: 1 m in 8.4 s (x) or 11.4 s (y), a quarter turn about x in 5.4 s."""
    _, found = checked(fulmar, "int_ball2")
    assert found["actuators"] | {"axes": 6} == {"count": 8, "rank": 6, "missing_axes": [], "axes": 6}
    assert found["wrench"]["force_n"] == pytest.approx([0.1810, 0.0996, 0.1222], rel=1e-3)
    assert found["wrench"]["torque_nm"] == pytest.approx([3.03e-3, 4.55e-3, 8.19e-3], rel=1e-3)
    assert found["wrench"]["force_n_about_com"][0] < found["wrench"]["force_n"][0]
    assert found["least_time"]["metre_s"][:2] == pytest.approx([8.4, 11.4], abs=0.05)
    assert found["least_time"]["quarter_turn_s"][0] == pytest.approx(5.4, abs=0.05)


def test_the_spacecraft_s_limits_are_those_of_its_shared_line_with_the_others_beside(fulmar):
    _, found = checked(fulmar, "spacecraft_16")
    wrench = found["wrench"]
    assert wrench["shared_line"]
    assert wrench["force_n"] == pytest.approx([0.7071, 0.7071, 1.0], rel=1e-3)
    assert wrench["without_shared_line"]["force_n"] == pytest.approx([2.828, 2.828, 4.0], rel=1e-3)
    assert wrench["without_shared_line"]["torque_nm"] == pytest.approx([0.877, 0.877, 1.24], rel=1e-3)


def test_planar_robots_are_evaluated_in_the_plane(fulmar):
    _, found = checked(fulmar, "floating_platform")
    assert found["actuators"]["axes"] == ["force_x", "force_y", "torque_z"]
    assert found["actuators"]["rank"] == 3
    assert found["wrench"]["force_n"][2] is None
    assert found["least_time"]["quarter_turn_s"][:2] == [None, None]


def test_a_car_turns_by_driving_and_a_boat_is_weaker_astern(fulmar):
    _, car = checked(fulmar, "leatherback")
    assert car["actuators"]["missing_axes"] == ["force_y"]
    assert car["wrench"]["torque_nm"][2] == 0.0
    assert car["least_time"]["quarter_turn_s"][2] > 0.0
    _, boat = checked(fulmar, "kingfisher")
    low, high = boat["wrench"]["force_range_n"][0]
    assert boat["wrench"]["force_n"][0] == pytest.approx(-low)
    assert high > -low


def test_wheels_are_no_faster_than_they_turn(fulmar):
    """Turtlebot2: 24 N on its mass would pass 1 m in less, but for its top speed."""
    robot = yaml.safe_load(config_path("robots", "turtlebot2").read_text(encoding="utf-8"))
    _, found = checked(fulmar, "turtlebot2")
    assert found["least_time"]["metre_s"][0] > 1.0 / robot["actuators"]["max_speed"]
    assert found["least_time"]["metre_s"][1] is None


def test_the_placeholder_of_roboran_has_one_problem(fulmar):
    code, found = checked(fulmar, NEW / "placeholder_ball.yaml")
    assert code == 1
    assert found["actuators"]["rank"] == 5
    assert found["actuators"]["missing_axes"] == ["torque_y"]
    assert not found["passed"]
    assert not found["controllable"]
    (problem,) = found["problems"]
    assert "rank 5 of 6" in problem
    assert "torque about y (pitch)" in problem


@pytest.mark.parametrize("name", ["cubesat_8_srb_layout", "cubesat_8_srb"])
def test_the_cubesats_of_srb_have_one_problem(fulmar, name):
    """Their nozzles turn the body about x and y alone, at 20 kg and 1 N as at 1 kg and 5 N."""
    code, found = checked(fulmar, NEW / f"{name}.yaml")
    assert (code, found["passed"], found["controllable"]) == (1, False, False)
    assert (found["actuators"]["rank"], found["actuators"]["missing_axes"]) == (5, ["torque_z"])
    (problem,) = found["problems"]
    assert "rank 5 of 6: no command makes a torque about z (yaw) alone" in problem


def test_an_inertia_that_no_body_has_is_one_problem(fulmar, tmp_path):
    path = altered(tmp_path, body__inertia=[0.05, 0.05, 0.2045])
    code, found = checked(fulmar, path)
    assert (code, found["passed"], found["wrench"]) == (1, False, None)
    (problem,) = found["problems"]
    assert str(path) in problem
    assert "no body has a moment beyond the sum of the two others" in problem


@pytest.mark.parametrize(
    ("inertia", "words"),
    [
        ([-0.2, 0.2, 0.2], "xx, yy and zz must be greater than 0"),
        ([0.0, 0.2, 0.2], "xx, yy and zz must be greater than 0"),
        ([0.2, 0.2, 0.2, 0.3, 0.0, 0.0], "has principal moments of -0.1, 0.2, 0.5 kg·m²"),
        ([0.2, 0.2], "needs three or six values"),
    ],
)
def test_what_is_no_inertia_at_all_is_one_problem_with_what_was_found(fulmar, tmp_path, inertia, words):
    path = altered(tmp_path, body__inertia=inertia)
    code, found = checked(fulmar, path)
    assert (code, found["passed"], found["wrench"]) == (1, False, None)
    (problem,) = found["problems"]
    assert str(path) in problem
    assert words in problem
    assert "\n" not in problem
    assert not fulmar("check", "robot", str(path))[2]


@pytest.mark.parametrize(
    "change", [{"body__inertia": [0.2, 0.2, 0.2, 0.01, 0.0, 0.0]}, {"body__center_of_mass": [0.0, 0.0, 0.02]}]
)
def test_mass_properties_of_space_in_the_plane_are_one_problem(fulmar, tmp_path, change):
    path = altered(tmp_path, "floating_platform", **change)
    code, found = checked(fulmar, path)
    assert (code, found["passed"], found["wrench"]) == (1, False, None)
    (problem,) = found["problems"]
    assert str(path) in problem
    assert "a robot on a floor or on water has xx, yy, zz and x, y" in problem


def test_a_gyroscope_that_cannot_see_what_the_gates_reject_is_one_problem(fulmar, tmp_path):
    path = altered(tmp_path, sensors__imu__gyroscope={"limit": 4.0})
    code, found = checked(fulmar, path)
    assert code == 1
    (problem,) = found["problems"]
    assert "'limits.yaw_rate' = 6 rad/s must be below the gyroscope's range, 4 rad/s" in problem


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("body__radius", 310.0, "Is it in mm?"),
        ("actuators__thrust", 1000.0, "Is it in mN?"),
        ("uncertainty__mass", [1.0, 2.0], "does not hold the body's own"),
    ],
)
def test_an_implausible_value_is_one_problem_with_its_line(fulmar, tmp_path, key, value, words):
    code, found = checked(fulmar, altered(tmp_path, **{key: value}))
    assert code == 1
    assert set(found) == KEYS
    (problem,) = found["problems"]
    assert words in problem


@pytest.mark.parametrize(("force", "code", "where"), [(4.0, 0, "warnings"), (10.0, 1, "problems")])
def test_performance_beyond_what_actuators_give_is_a_warning_and_far_beyond_a_problem(
    fulmar, tmp_path, force, code, where
):
    found_code, found = checked(fulmar, altered(tmp_path, performance__force=force))
    assert found_code == code
    (line,) = found["problems"] + found["warnings"]
    assert found[where] == [line]
    assert f"'performance.force' = {force:g} N" in line
    assert "1 N at most" in line


def test_an_unusual_value_is_a_warning_and_passes(fulmar, tmp_path):
    code, found = checked(fulmar, altered(tmp_path, timing__physics_dt=0.1))
    assert (code, found["problems"]) == (0, [])
    (warning,) = found["warnings"]
    assert "'timing.physics_dt' = 0.1 s is unusual" in warning


def test_valves_that_no_law_in_space_allocates_are_a_warning_and_refused_before_anything_starts(
    fulmar, tmp_path, monkeypatch
):
    path = altered(tmp_path, actuators__continuous=True)
    code, found = checked(fulmar, path)
    assert (code, found["passed"]) == (0, True)
    (warning,) = found["warnings"]
    assert warning.startswith(
        "no controller but a policy can drive it: valves that open by degrees on one line"
    )
    (tmp_path / "robots").mkdir()
    own = path.read_text(encoding="utf-8").replace("name: spacecraft_16", "name: proportional")
    (tmp_path / "robots" / "proportional.yaml").write_text(own, encoding="utf-8")
    monkeypatch.setenv(OWN_FOLDERS, str(tmp_path))
    code, _, err = fulmar("run", "proportional", "--controller", "lqr", "--goal", "1,0,0,0,0,0")
    assert code == 2
    assert "no classical law is for 'proportional': valves that open by degrees" in err


def test_nozzles_that_push_one_way_only_are_a_problem(fulmar, tmp_path):
    path = altered(tmp_path, "floating_platform")
    robot = yaml.safe_load(path.read_text(encoding="utf-8"))
    for nozzle in robot["actuators"]["nozzles"]:
        nozzle["direction"][0] = abs(nozzle["direction"][0])
    path.write_text(yaml.safe_dump(robot), encoding="utf-8")
    code, found = checked(fulmar, path)
    assert code == 1
    assert found["actuators"]["rank"] == 3
    assert not found["zero_wrench_holdable"]
    (problem,) = found["problems"]
    assert "negative force along x" in problem
    _, out, _ = fulmar("check", "robot", str(path))
    (alone,) = [line for line in out.splitlines() if "each by itself" in line]
    assert "x 0 to " in alone


def test_people_get_the_same_in_lines(fulmar):
    code, out, err = fulmar("check", "robot", "spacecraft_16")
    assert (code, err) == (0, "")
    assert "16, rank 6 of 6" in out
    assert "x ±2.828, y ±2.828, z ±4 N" in out
    assert out.endswith("passed\n")
    code, out, _ = fulmar("check", "robot", str(NEW / "placeholder_ball.yaml"))
    assert code == 1
    assert out.count("problem:") == 1
    assert out.endswith("not passed\n")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (None, "cannot be read"),
        ("body: [", "not valid YAML"),
        ("names_: spacecraft_16", "unknown key 'names_'. Did you mean 'name'?"),
        ("name: [1]", "must be a single value"),
    ],
)
def test_a_file_that_cannot_be_read_is_bad_usage(fulmar, tmp_path, text, words):
    path = tmp_path / "mine.yaml"
    if text is not None:
        path.write_text(text, encoding="utf-8")
    assert words in complaint(fulmar("check", "robot", str(path)))


def test_an_unknown_name_gets_the_nearest_one(fulmar):
    assert "Did you mean 'int_ball2'?" in complaint(fulmar("check", "robot", "int_ball"))


@pytest.mark.parametrize(
    ("name", "directions"),
    [
        ("floating_platform", 20),  # fewer corners, in a fraction of the time
        *(
            pytest.param(name, wrench_limits.DIRECTIONS, marks=pytest.mark.slow)
            for name in ("int_ball2", "floating_platform", "turtlebot2")
        ),
    ],
)
def test_the_figure_is_small_and_not_empty(fulmar, tmp_path, monkeypatch, name, directions):
    pytest.importorskip("matplotlib")
    monkeypatch.setattr(wrench_limits, "DIRECTIONS", directions)
    from matplotlib.image import imread

    file = tmp_path / "wrench.png"
    code, _, err = fulmar("check", "robot", name, "--plot", str(file))
    assert code == 0
    assert str(file) in err
    assert file.stat().st_size < 500_000
    image = imread(file)
    assert image.shape[1] > 800
    blue = (image[..., 2] - image[..., 0] > 0.1).mean()  # what is filled
    assert 0.005 < blue < 0.6


def test_an_aircraft_is_trimmed_where_asked_and_its_modes_have_names(fulmar):
    code, out, _ = fulmar("check", "robot", "navion", "--speed", "53.64", "--altitude", "0", "--json")
    (trim,) = json.loads(out)["trim"]
    assert (code, trim["speed"], trim["height"], trim["altitude"]) == (0, 53.64, None, 0.0)
    assert set(trim) == {
        "speed",
        "height",
        "altitude",
        "alpha_deg",
        "elevator_deg",
        "throttle",
        "thrust_n",
        "modes",
    }
    modes = {mode["name"]: mode for mode in trim["modes"]}
    assert set(modes) == {"short period", "phugoid", "roll", "Dutch roll", "spiral"}
    assert modes["short period"]["frequency"] == pytest.approx(3.57, abs=0.05)  # Nelson: 3.6 rad/s
    assert modes["roll"]["real"] == pytest.approx(-8.43, abs=0.05)  # Nelson: -8.435


def test_an_aircraft_without_a_trim_there_is_one_line(fulmar):
    assert "'navion' has no trim at 10 m/s" in complaint(fulmar("check", "robot", "navion", "--speed", "10"))
    assert "height = -1 m must be" in complaint(
        fulmar("check", "robot", "navion", "--speed", "50", "--height", "-1")
    )
    assert "are for aircraft" in complaint(fulmar("check", "robot", "jetbot", "--speed", "1"))


@pytest.mark.slow
def test_the_envelope_of_an_aircraft_is_drawn(fulmar, tmp_path):
    code, _, _ = fulmar("check", "robot", "airship_v7", "--plot", str(tmp_path / "envelope.png"))
    assert code == 0
    assert (tmp_path / "envelope.png").stat().st_size > 10_000


@pytest.mark.parametrize("name", ["x.txt", "x", "x.PNGG"])
def test_a_figure_of_no_known_kind_is_refused_before_anything_is_computed(fulmar, tmp_path, name):
    said = complaint(fulmar("check", "robot", "microsat", "--plot", str(tmp_path / name)))
    assert "cannot be drawn. Give a name that ends in .png, .svg, .pdf." in said


def test_a_name_that_no_node_has_is_a_problem_line(fulmar, tmp_path):
    path, _ = wrong_robots.altered(tmp_path, "spacecraft_16", {"name": "my-bot"})
    code, out, _ = fulmar("check", "robot", str(path))
    assert code == 1
    assert "problem: " in out
    assert "the name 'my-bot' of a robot must begin with a small letter" in out
