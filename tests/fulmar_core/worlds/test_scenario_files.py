"""What scenario files may say: entries without meaning are refused, and names are found."""

from __future__ import annotations

from dataclasses import replace

import pytest

from fulmar_core.config.errors import UnknownNameError
from fulmar_core.worlds.parts import Actuation, Kick, Push, Sensing, Slope, Tether, Wave
from fulmar_core.worlds.scenario import Scenario, load_scenario

STILL = Scenario("nothing happens", sensor_noise=False, body="nominal")


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: Push(force=-1.0), "must not be negative"),
        (lambda: Push(torque=-1.0), "must not be negative"),
        (lambda: Push(least=1.5), "must lie in"),
        (lambda: Actuation(noise=-1.0), "must not be negative"),
        (lambda: Actuation(gain=(1.0, 0.5)), "low <= high"),
        (lambda: Actuation(failure_chance=1.5), "at most 1"),
        (lambda: Wave(force=-1.0), "must not be negative"),
        (lambda: Wave(wave_number=(2.0, 1.0)), "low <= high"),
        (lambda: Wave(least=1.5), "must lie in"),
        (lambda: Tether(stiffness=(0.2, 0.1)), "low <= high"),
        (lambda: Tether(lever=-1.0), "must not be negative"),
        (lambda: Slope(milliradians=(2.0, 1.0)), "low <= high"),
        (lambda: Actuation(opening_delay_s=(0.2, 0.1)), "low <= high"),
        (lambda: Actuation(least_noise=1.5), "must lie in"),
        (lambda: Actuation(least_delay=-0.5), "must lie in"),
        (lambda: Sensing(velocity_noise=(0.2, 0.1)), "low <= high"),
        (lambda: Kick(force=-1.0), "must not be negative"),
        (lambda: Kick(every_s=(0.0, 1.0)), "greater than 0"),
        (lambda: Sensing(noise=-1.0), "must not be negative"),
        (lambda: Sensing(dropout=1.5), "at most 1"),
        (lambda: Actuation(failures=2), "need one another"),
        (lambda: Actuation(failure_chance=0.5), "need one another"),
        (lambda: replace(STILL, sensing=Sensing(delay_s=0.4)), "do nothing where 'sensor_noise' is false"),
        (lambda: replace(STILL, sensing=Sensing(dropout=0.9)), "do nothing where 'sensor_noise' is false"),
    ],
)
def test_entries_without_meaning_are_refused(build, words):
    with pytest.raises(ValueError, match=words):
        build()


def test_an_unknown_scenario_gets_the_nearest_name():
    with pytest.raises(UnknownNameError, match=r"^unknown scenario 'nominall'\. Did you mean 'nominal'\?$"):
        load_scenario("nominall")


@pytest.mark.parametrize("name", ["bearing_late_s", "held_s"])
def test_times_that_end_before_they_begin_are_refused(name):
    with pytest.raises(ValueError, match=name):
        replace(STILL, **{name: (2.0, 1.0)})


def test_an_old_name_of_a_scenario_works_and_warns(caplog):
    old, new = "drift_stranded", "drift_uncontrollable"  # word: old name of a scenario
    with caplog.at_level("WARNING", logger="fulmar_core"):
        assert load_scenario(old) == load_scenario(new)
    (record,) = caplog.records
    assert old in record.getMessage()
    assert new in record.getMessage()
