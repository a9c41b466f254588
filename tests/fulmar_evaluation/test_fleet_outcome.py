"""Bags of a fleet's run: read once, whatever asks for them."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest

from fulmar_bringup.fleet_plan import FleetChoices, fleet_plan
from fulmar_evaluation import fleet_outcome
from fulmar_evaluation.fleet_outcome import OpenBags


@pytest.mark.parametrize("record_each", [False, True])
def test_a_bag_of_all_robots_is_read_once_and_each_own_bag_too(
    record_each: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    read: list[str] = []

    def open_one(path: Path) -> SimpleNamespace:
        read.append(path.name)
        return SimpleNamespace(of_robot=lambda name: f"{name} of all", name=path.name)

    monkeypatch.setattr(fleet_outcome, "open_bag", open_one)
    monkeypatch.setattr(fleet_outcome, "run_in", lambda bag: bag)
    plan = fleet_plan("fleet", FleetChoices(record=tmp_path / "bag", record_each=record_each))
    bags = OpenBags(plan)
    found = [bags.record_of(one) for one in plan.robots for _ in range(2)]
    if record_each:
        assert read == ["alpha", "beta", "boat"]
        assert [getattr(each, "name", each) for each in found[::2]] == read
    else:
        assert read == ["bag"]
        assert found[::2] == ["alpha of all", "beta of all", "boat of all"]
