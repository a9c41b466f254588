"""`fulmar benchmark recorder` in small: the same behaviours, without the figures that take minutes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from fulmar_bags.mcap_records import bag_files
from tests.conftest import RosDomain
from tests.ros.cli import fulmar, json_of

real_time = pytest.mark.real_time


@real_time
@pytest.mark.slow
def test_killed_recorders_leave_bags_that_two_readers_open(ros_domain: RosDomain, tmp_path: Path) -> None:
    """One of them with a new file each second."""
    asked = ("benchmark", "recorder", "--parts", "kills", "--kills", "2", "--out", "bags", "--json")
    figures = json_of(fulmar(*asked, env=ros_domain.env, cwd=tmp_path).stdout)["kills"]
    assert figures["opened_by_rosbags_and_mcap"] == figures["kills"] == 2
    assert figures["bags_with_gaps"] == 0
    assert len(bag_files(tmp_path / "bags" / "killed_0")) == 1


@real_time
@pytest.mark.slow
def test_lock_step_loses_no_message_of_any_step(ros_domain: RosDomain, tmp_path: Path) -> None:
    """Six wires, compared step by step."""
    asked = ("benchmark", "recorder", "--parts", "lockstep", "--lockstep-s", "8", "--out", "bags", "--json")
    figures = json_of(fulmar(*asked, env=ros_domain.env, cwd=tmp_path).stdout)["lockstep"]
    assert figures["failure"] is None
    assert figures["sent"] == 8 * 25 * 6
    assert not any(figures["lost"].values())


@real_time
@pytest.mark.slow
def test_the_cost_is_reported_for_both_with_its_interval(ros_domain: RosDomain, tmp_path: Path) -> None:
    """Real plant, real controller, a recorder that comes and goes."""
    small = ("--parts", "cost", "--stretches", "2", "--stretch-s", "1")
    asked = ("benchmark", "recorder", *small, "--out", "bags", "--json")
    figures = json_of(fulmar(*asked, env=ros_domain.env, cwd=tmp_path).stdout)["cost"]
    for name in ("recorded", "not_recorded"):
        assert figures[name]["commands"] > 50
        assert 0.0 < figures[name]["p50_ms"] <= figures[name]["p99_ms"] <= figures[name]["max_ms"]
    low, high = figures["p99_ratio_95"]
    assert low <= figures["p99_ratio"] <= high
    low, high = figures["p99_ratio_of_pairs_median_95"]
    assert low <= figures["p99_ratio_of_pairs_median"] <= high
    assert figures["passed"] == (figures["p99_ratio_of_pairs_median"] <= figures["allowed"])
    assert sorted(path.name for path in (tmp_path / "bags").iterdir()) == ["cost_0", "cost_3"]


def test_an_unknown_part_is_refused_with_the_nearest(fulmar: Callable[..., tuple[int, str, str]]) -> None:
    """Before anything starts."""
    code, _, said = fulmar("benchmark", "recorder", "--parts", "kils")
    assert code == 2
    assert "Did you mean 'kills'" in said
