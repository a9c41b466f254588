"""From a geometry to a lattice, and from what a lattice answers to coefficients; without a lattice."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.strict_yaml import load_config
from fulmar_core.dynamics.flight_trim import find_trim
from fulmar_core.robots.airframe.atmosphere import SEA_LEVEL
from fulmar_core.robots.robot_file import load_robot, load_robot_file
from fulmar_evaluation.new_airframe import coefficient_set as module
from fulmar_evaluation.new_airframe.coefficient_set import coefficient_set
from fulmar_evaluation.new_airframe.geometry import Flap, Geometry
from fulmar_evaluation.new_airframe.robot_file import write_robot
from tests.fulmar_cli.command_line import complaint

FILE = Path(__file__).parents[1] / "peers" / "airship_v7_geometry.yaml"
CRAFT = load_config(Geometry, FILE)
# What a made-up craft has, per rad; the lattice below answers exactly so.
TERMS = {
    "CL": {"1": 0.3, "alpha": 5.0, "elevator": 0.9, "q": 9.0},
    "CD": {"1": 0.01, "alpha": 0.1, "alpha^2": 1.1},
    "Cm": {"1": 0.02, "alpha": -0.6, "elevator": -2.5, "q": -20.0},
    "CY": {"beta": -0.4, "aileron": 0.02, "rudder": 0.15, "p": -0.1, "r": 0.3},
    "Cl": {"beta": -0.1, "aileron": 0.3, "rudder": 0.01, "p": -0.45, "r": 0.12},
    "Cn": {"beta": 0.05, "aileron": -0.01, "rudder": -0.07, "p": -0.03, "r": -0.12},
}


def area_of(mesh):
    """Of all panels of a mesh, shape (rows + 1, columns + 1, 3) [m²]."""
    across, down = mesh[1:, 1:] - mesh[:-1, :-1], mesh[1:, :-1] - mesh[:-1, 1:]
    return 0.5 * np.linalg.norm(np.cross(across, down), axis=-1).sum()


def test_a_flat_lattice_has_the_area_of_the_wing_and_its_chord():
    flat = replace(CRAFT, wing=replace(CRAFT.wing, dihedral_deg=0.0, incidence_deg=0.0, zero_lift_deg=0.0))
    mesh = flat.meshes()["wing"]
    assert area_of(mesh) == pytest.approx(CRAFT.wing.area, rel=1e-6)
    assert CRAFT.wing.area == pytest.approx(3.3621, rel=1e-4)
    assert mesh[-1, 12, 0] - mesh[0, 12, 0] == pytest.approx(CRAFT.wing.root_chord)
    assert mesh[0, 0, 1] == pytest.approx(-0.5 * CRAFT.wing.span)
    quarter = mesh[0, 12, 0] + 0.25 * CRAFT.wing.root_chord
    assert quarter == pytest.approx(-CRAFT.wing.position[0]), "ahead is negative here"


def test_flaps_turn_the_documented_way_and_nothing_else_moves():
    still = CRAFT.meshes()
    elevator, aileron, rudder = (CRAFT.meshes(**{name: 0.1}) for name in ("elevator", "aileron", "rudder"))
    assert (elevator["tail"][-1, :, 2] < still["tail"][-1, :, 2]).all(), "trailing edge down"
    moved = aileron["wing"][-1, :, 2] - still["wing"][-1, :, 2]
    right = still["wing"][-1, :, 1] > 0.0
    assert moved[right].max() > 0.0, "the right one goes up"
    assert moved[~right].min() < 0.0
    assert (moved[right] >= 0.0).all()
    assert (rudder["fin"][-1, :, 1] < 0.0).all(), "to the left, where y is negative"
    for one, name in ((elevator, "wing"), (aileron, "tail"), (rudder, "wing")):
        np.testing.assert_array_equal(one[name], still[name])


@pytest.fixture
def lattice(monkeypatch):
    """A lattice that answers by `TERMS`; it sees deflections only in the order of the questions."""
    moved = (None, "elevator", "aileron", "rudder", None, None, None)
    seen = []

    def loads(geometry, _python, states):
        wing, found = geometry.wing, {name: np.zeros(len(states)) for name in TERMS}
        for number, state in enumerate(states):
            p, q, r = np.array(state["rate"]) / (2.0 * geometry.speed)
            flow = {
                "1": 1.0, "alpha": np.deg2rad(state["alpha"]), "beta": np.deg2rad(state["beta"]),
                "alpha^2": np.deg2rad(state["alpha"]) ** 2,
                "p": p * wing.span, "q": q * wing.mean_chord, "r": r * wing.span,
            }  # fmt: skip
            if state["meshes"]:
                sign = 1.0 if number % 2 == 0 else -1.0
                flow[moved[number // 2]] = sign * np.deg2rad(1.0)
            seen.append(state)
            for name, each in TERMS.items():
                found[name][number] = sum(value * flow.get(key, 0.0) for key, value in each.items())
        return found

    monkeypatch.setattr(module, "_loads", loads)
    return seen


def test_coefficients_come_back_from_what_the_lattice_answers(lattice):
    found = coefficient_set(CRAFT, Path("nowhere"))
    for name, each in TERMS.items():
        expected = dict(each)
        if name == "CD":
            expected["1"] += CRAFT.profile_drag
        assert found[name] == pytest.approx(expected), name
    lift = CRAFT.mass * 9.81 / (0.5 * SEA_LEVEL * CRAFT.speed**2 * CRAFT.wing.area)
    assert lattice[-1]["alpha"] == pytest.approx(np.rad2deg((lift - 0.3) / 5.0)), (
        "derivatives are those of cruise"
    )


def test_the_file_is_a_robot_with_these_coefficients(lattice, tmp_path):
    out = write_robot(CRAFT, coefficient_set(CRAFT, Path("nowhere")), tmp_path / "v7_lattice.yaml", "made up")
    robot = load_robot_file(out)
    assert robot.body.mass == 120.0
    assert robot.airframe.chord == pytest.approx(CRAFT.wing.mean_chord, abs=1e-6)
    assert robot.airframe.aerodynamics.terms["Cm"]["q"] == -20.0
    assert robot.actuators.names[:3] == ("elevator", "aileron", "rudder")
    assert out.read_text(encoding="utf-8").startswith("# made up\n")


def test_mistakes_are_one_line_with_what_to_do(fulmar, tmp_path):
    out = tmp_path / "craft.yaml"
    assert "make peers" in complaint(
        fulmar("new", "airframe", str(FILE), "--out", str(out), "--python", "none")
    )
    assert "ends in .yaml" in complaint(
        fulmar("new", "airframe", str(FILE), "--out", str(tmp_path / "craft.txt"))
    )
    bad = tmp_path / "bad.yaml"
    bad.write_text(FILE.read_text(encoding="utf-8").replace("taper: 0.39", "tapper: 0.39"), encoding="utf-8")
    assert "Did you mean 'taper'?" in complaint(fulmar("new", "airframe", str(bad), "--out", str(out)))
    assert not out.exists()
    out.write_text("mine", encoding="utf-8")
    assert "no file is overwritten" in complaint(fulmar("new", "airframe", str(FILE), "--out", str(out)))
    assert out.read_text(encoding="utf-8") == "mine"


def test_a_python_without_the_lattice_is_named(tmp_path):
    says = "the vortex lattice failed: ModuleNotFoundError: No module named 'openmdao'"
    with pytest.raises(ConfigError, match=says):
        coefficient_set(CRAFT, Path(sys.executable))


def test_an_aircraft_like_none_is_refused(lattice, tmp_path):
    other = replace(CRAFT, like="turtlebot2")
    with pytest.raises(ConfigError, match="'like: turtlebot2' is no aircraft"):
        write_robot(other, coefficient_set(other, Path("nowhere")), tmp_path / "x.yaml", "made up")


@pytest.mark.parametrize("wrong", [{"chord": 0.0}, {"begin": 0.6, "end": 0.5}])
def test_a_flap_lies_within_its_surface(wrong):
    with pytest.raises(ValueError, match="'chord' must lie in"):
        Flap(**wrong)


def test_an_aircraft_that_no_robot_can_be_leaves_no_file_behind(lattice, tmp_path):
    out = tmp_path / "light.yaml"
    feather = replace(CRAFT, mass=1e-6)
    with pytest.raises(ConfigError, match=r"light\.yaml"):
        write_robot(feather, coefficient_set(feather, Path("nowhere")), out, "made up")
    assert not out.exists()
    out.write_text("mine", encoding="utf-8")
    with pytest.raises(ConfigError):
        write_robot(feather, coefficient_set(feather, Path("nowhere")), out, "made up")
    assert out.read_text(encoding="utf-8") == "mine"


SMALL = {"mass": 2.0, "inertia": (0.05, 0.1, 0.14), "speed": 15.0}


def shrunk(craft, factor, **more):
    """The same shape of another size."""
    parts = {
        name: replace(
            part,
            span=factor * part.span,
            root_chord=factor * part.root_chord,
            position=tuple(factor * each for each in part.position),
        )
        for name in ("wing", "tail", "fin")
        for part in [getattr(craft, name)]
    }
    return replace(craft, **parts, **more)


@pytest.mark.parametrize(
    ("like", "factor", "more"),
    [
        ("airship_v7", 0.24, SMALL),
        ("a0s", 1.0, {"speed": 31.0}),
        ("skywalker_x8", 0.24, SMALL),
        ("navion", 0.24, SMALL),
    ],
)
def test_an_aircraft_of_any_size_is_one_whatever_it_is_like(lattice, tmp_path, like, factor, more):
    craft = shrunk(replace(CRAFT, like=like), factor, **more)
    out = write_robot(craft, coefficient_set(craft, Path("nowhere")), tmp_path / "craft.yaml", "made up")
    robot = load_robot_file(out)
    tail = abs(craft.tail.position[0]) + craft.tail.root_chord
    assert max(0.5 * craft.wing.span, abs(craft.tail.position[0])) < robot.body.radius
    assert robot.body.radius < 1.1 * np.hypot(tail, 0.5 * craft.wing.span)
    assert robot.body.footprint[1] == pytest.approx(craft.wing.span, abs=0.002)
    model = load_robot(like)
    thrust, theirs = (sum(motor.engine.thrust for motor in each.actuators.motors) for each in (robot, model))
    assert thrust / robot.body.mass == pytest.approx(theirs / model.body.mass, rel=1e-4)
    assert robot.performance.force / thrust == pytest.approx(model.performance.force / theirs, rel=1e-4)
    assert find_trim(robot, craft.speed).throttle < 0.9


def test_a_mistake_names_the_geometry_and_what_followed_from_it(lattice, tmp_path):
    heavy = replace(CRAFT, inertia=(0.05, 0.1, 0.14))
    words = r"^my\.yaml: makes no aircraft, .*'body.inertia.2' = 0.14 .*radius of 2.58"
    with pytest.raises(ConfigError, match=words) as said:
        terms = coefficient_set(heavy, Path("nowhere"))
        write_robot(heavy, terms, tmp_path / "craft.yaml", "made up", geometry="my.yaml")
    assert "craft.yaml:" not in str(said.value)


@pytest.mark.parametrize("count", [2, 4, 5, 7])
def test_an_inertia_has_three_or_six_numbers(count):
    with pytest.raises(ValueError, match="three or six numbers"):
        replace(CRAFT, inertia=(1.0,) * count)
