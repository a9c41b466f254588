"""Reports of flights: height beside its reference, measured surfaces, energy; no view at one scale."""

from __future__ import annotations

import dataclasses
import warnings
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure

from fulmar_bags.contents import open_bag
from fulmar_bags.decode import odometries
from fulmar_bags.run_record import NO_SURFACES, read_run
from fulmar_core.controllers.classical import load_classical
from fulmar_core.controllers.controller import Inputs
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.topics import ODOMETRY
from fulmar_core.simulation.episode import draw_episode
from fulmar_core.states.spatial import SpatialState
from fulmar_core.tasks import load_task
from fulmar_core.tasks.references.flight_paths import PATHS
from fulmar_core.worlds.scenario import Scenario
from fulmar_evaluation.report.bag_report import _drawings
from fulmar_evaluation.report.flight_plot import (
    draw_flight,
    draw_flight_motion,
    draw_surfaces,
    flight_rows,
    reference_places,
)
from fulmar_evaluation.report.run_report import write_report
from fulmar_evaluation.report.run_view import result_of, views
from sim_nodes.mock_backend import MockBackend
from tests.fulmar_evaluation.test_report import Page
from tests.synthetic_run import EPOCH_NS, NS, RunMessages

SECONDS = 2.0
INFO = {
    "task": "fly_f",
    "controller": "lqi",
    "robot": "airship_v7",
    "backend": "mock",
    "seed": 3,
    "lockstep": True,
    "rate": 1.0,
    "control_hz": 100.0,
    "scenario": "nominal",
}


def write_flight(folder, name="fly_f"):
    """Two seconds of a flight in the core's dynamics, as the nodes would publish it."""
    robot = load_robot("airship_v7")
    task = load_task(name).fitted(robot)
    exact = Scenario("exact", sensor_noise=False, body="nominal")
    episode = draw_episode(robot, task, exact, seed=3, number=0)
    backend, law, bag = (
        MockBackend(robot),
        load_classical(robot, task),
        RunMessages(folder, robot, INFO | {"task": name}),
    )
    bag.goal(task.goal_topic, episode.goal, EPOCH_NS)
    sample, command = backend.reset(episode, seed=3), robot.actuators.safe_command
    law.reset()
    goal = task.begun(episode.goal, episode.start)
    for tick in range(round(100 * SECONDS) + 1):
        time_s, now_ns = 0.01 * tick, EPOCH_NS + round(0.01 * tick * NS)
        bag.odometry("ground_truth/odom", sample.truth, time_s, now_ns)
        bag.odometry("odom", sample.truth, time_s, now_ns)
        positions = sample.readings["surfaces"].value.positions
        bag.joints("surfaces/state", positions, time_s, now_ns, field="position")
        state = SpatialState.from_rigid(sample.truth)
        goal = task.advance(goal, state, np.asarray(time_s))
        inputs = Inputs(state[None], goal[None], np.zeros((1, 0)), command[None], None, tick, 0.01)
        command = robot.actuators.limited(law.act(inputs)[0])
        bag.joints("actuators/state", command, time_s, now_ns)
        sample = backend.step(command)
    bag.writer.close()
    return folder


@pytest.fixture(scope="module")
def flight(tmp_path_factory):
    return read_run(write_flight(tmp_path_factory.mktemp("runs") / "flight"))


def test_a_bag_keeps_where_the_surfaces_stood(flight):
    assert flight.surfaces.names == ("elevator", "aileron", "rudder", "throttle_left", "throttle_right")
    assert len(flight.surfaces) == len(flight.motion)
    lag = flight.surfaces.positions[1:] - flight.applied.effort[:-1]
    assert np.abs(lag[:, 0]).max() > 1e-3, "positions are measured, and not the commands"
    assert np.abs(lag[-50:, 3]).max() < 0.1


def test_a_page_of_a_flight_shows_height_surfaces_and_energy(flight, tmp_path):
    text = write_report([flight], tmp_path / "flight.html").read_text()
    words = " ".join(Page(text).words)
    for label in (
        "height [m]",
        "height error [m]",
        "full throttle [s]",
        "deflection [°]",
        "throttle",
        "LQI, measured",
    ):
        assert label in words
    assert "body's x" not in words


def test_the_reference_is_a_line_and_no_staircase(flight):
    (run,) = views([flight])
    places, time_s = reference_places(run.result), run.result.time_s
    np.testing.assert_allclose(places[:-11, 2], 3.0 - 2.0 * np.cos(0.2 * time_s[:-11]), rtol=0, atol=2e-3)


def test_energy_is_the_mean_square_of_the_throttles_added_up(flight):
    rows = Figure().subplots(3, 1)
    draw_flight(rows, views([flight]))
    energy = rows[2].lines[0].get_ydata()
    throttles = flight.applied.effort[:-1, 3:]
    assert energy[-1] == pytest.approx(0.01 * np.sum(np.mean(throttles**2, axis=1)), rel=1e-6)


def test_a_bag_without_measured_surfaces_shows_what_was_applied(flight):
    (run,) = views([dataclasses.replace(flight, surfaces=NO_SURFACES)])
    rows = Figure().subplots(2, 1)
    draw_surfaces(rows, run)
    assert rows[0].get_title(loc="left") == "LQI, applied"
    elevator = rows[0].lines[0].get_ydata()
    np.testing.assert_allclose(elevator, np.rad2deg(flight.applied.effort[:-1, 0]), rtol=0, atol=1e-4)


def test_a_plot_of_any_bag_has_a_panel_of_measured_surfaces(flight):
    bag = open_bag(flight.path)
    titles = [drawing.title for drawing in _drawings(bag, odometries(bag.of(ODOMETRY)))]
    assert "What the actuators did: /airship_v7/surfaces/state" in titles


def test_the_reference_rests_where_it_is_level_and_climbs_between_places():
    task = load_task("fly_b").fitted(load_robot("airship_v7"))
    dt, times = 0.01, np.arange(0.0, 45.0, 0.01)
    side, above = PATHS["b"]
    passed = task.spacing_s * np.floor(times / task.spacing_s + 1e-6)
    aims = np.stack((28.0 * passed, side(passed), above(passed)), axis=-1)
    result = SimpleNamespace(task=task, aims=aims, run=SimpleNamespace(control_dt=dt))
    places = reference_places(result)
    assert (
        np.abs(places[: -round(task.spacing_s / dt), 2] - above(times)[: -round(task.spacing_s / dt)]).max()
        < 0.11
    )
    assert np.isnan(places[-1]).all(), "beyond the last place it is not known, rather than at rest"
    level = (times > 10.2) & (times < 29.9)
    assert np.ptp(places[level, 2]) == 0.0


def test_a_flight_without_a_reference_has_no_empty_panel(flight, tmp_path):
    runs = views([read_run(write_flight(tmp_path / "flight", "fly_attitude"))])
    assert (flight_rows(views([flight])), flight_rows(runs)) == (3, 2)
    axes = Figure().subplots(2, 1)
    draw_flight(axes, runs)
    assert all(each.lines for each in axes)


def test_a_page_of_a_flight_raises_no_warning_of_python(flight, tmp_path):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        write_report([flight], tmp_path / "sheet.png")


def test_speed_attitude_and_turn_rates_of_a_flight_are_drawn(flight):
    axes = Figure().subplots(3, 1)
    draw_flight_motion(axes, views([flight]))
    labels = [[line.get_label() for line in each.lines] for each in axes]
    assert labels[0] == ["over the ground"]
    assert labels[1][:2] == ["roll, right wing down", "pitch, nose up"]
    assert labels[2] == ["about x", "about y", "about z"]


def test_an_aircraft_touches_no_obstacle_but_the_water_or_the_ground(flight):
    (run,) = views([flight])
    figures = run.result.figures | {"collided": 1.0}
    touched = dataclasses.replace(run, result=dataclasses.replace(run.result, figures=figures))
    assert "touched the water or the ground" in result_of(touched)[1]
