"""Robots whose commands act later than their bundle was certified for do not start; what the guard believes is said."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from fulmar_bringup.envelope_check import envelope_note, guard_note
from fulmar_core.config.errors import BundleError
from fulmar_core.loop.controller_settings import ENVELOPE
from fulmar_core.robots.calibration import Calibration, Measured, calibrated
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.safety.declared_conditions import certified_body
from fulmar_evaluation.certify.document import write_into_passport
from tests.fulmar_evaluation.test_certify import SHIPPED, a_document

PLATFORM = load_robot("floating_platform")


def identified(delay_s: float, *, mass: float = 1.0, thrust: float = 1.0):
    """The platform as a calibration says it."""
    own, inertia = PLATFORM.body.mass, PLATFORM.body.inertia[2]
    near = [Measured(value, 0.98 * value, 1.02 * value) for value in (mass * own, inertia)]
    force = thrust * PLATFORM.actuators.thrust
    return calibrated(
        PLATFORM,
        Calibration(
            robot=PLATFORM.name,
            mass=near[0],
            yaw_inertia=near[1],
            thrust=Measured(force, force, force),
            delay=Measured(delay_s, delay_s, delay_s),
        ),
    )


@pytest.fixture
def bundle(tmp_path) -> Path:
    folder = Path(shutil.copytree(SHIPPED, tmp_path / "bundle"))
    write_into_passport(folder, a_document())
    return folder


@pytest.mark.parametrize("required", [True, False])
def test_a_robot_that_answers_later_than_its_set_holds_is_refused_whatever_is_asked_for(bundle, required):
    assert envelope_note(str(bundle), identified(0.04), "go_to_pose", required=required) == ""
    with pytest.raises(BundleError, match=r"act 0\.08 s later .*delay 0\.08 s is beyond 0\.05 s") as caught:
        envelope_note(str(bundle), identified(0.08), "go_to_pose", required=required)
    assert "\n" not in str(caught.value)


def test_a_delay_counts_from_that_of_the_robot_that_was_certified(bundle):
    body = certified_body(PLATFORM) | {"delay": 0.05}
    write_into_passport(bundle, a_document(body=body))
    assert envelope_note(str(bundle), identified(0.08), "go_to_pose", required=False) == ""


def test_a_bundle_without_an_axis_of_the_delay_allows_any(bundle):
    document = a_document(axes=a_document()["axes"][:1], box={"mass": [1.0, 1.5]})
    document["score"] = {"weights": {"linear": [1.0], "quadratic": [[0.0]]}, "threshold": 1.0}
    write_into_passport(bundle, document)
    assert envelope_note(str(bundle), identified(0.3), "go_to_pose", required=True) == ""


def test_a_run_of_a_robot_that_answers_too_late_ends_before_anything_starts(bundle, fulmar, tmp_path):
    path = tmp_path / "late.yaml"
    path.write_text("robot: floating_platform\ndelay: {value: 0.09, low: 0.08, high: 0.1}\n")
    words = (
        "run",
        "floating_platform",
        "--policy",
        bundle,
        "--calibration",
        path,
        "--lockstep",
        "--goal",
        "1,0,0",
    )
    code, _, err = fulmar(*words)
    assert code == 2 and "0.09 s later than those of the robot that it was certified for" in err


def test_the_guard_says_that_a_body_was_not_identified_as_well_as_it_believes():
    wide = replace(
        PLATFORM,
        uncertainty=replace(PLATFORM.uncertainty, yaw_inertia=(0.06, 2.0 * PLATFORM.body.inertia[2])),
    )
    line = guard_note(wide, ENVELOPE)
    assert "inertia by a factor of" in line and "more than 1.18" in line and "fulmar identify" in line
    assert guard_note(identified(0.02), ENVELOPE) == ""
    assert guard_note(wide, "") == "" and guard_note(load_robot("kingfisher"), ENVELOPE) == ""
