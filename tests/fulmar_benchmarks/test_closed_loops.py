"""Campaigns of runs: what is kept is not repeated, and what failed counts."""

from __future__ import annotations

import contextlib
import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import pytest

from fulmar_core.config.errors import UnknownNameError
from tests.benchmarks.closed_loops import FIRST_SEED, Campaign, Command, Episode, measure
from tests.benchmarks.hardware import CASES, cases_of


@dataclass(frozen=True)
class Recounted:
    """A case whose run is another program: it notes its seed and prints what a run prints."""

    name: str
    notes: Path
    robot: str = "turtlebot2"
    task: str = "go_to_position"

    def prepared(self, seed: int) -> contextlib.AbstractContextManager[Command]:
        said = {
            "success": seed % 2 == 0,
            "failure": None,
            "final_position_error_m": 0.1,
            "watchdog_trips": 0,
            "latency_ms": {"p99": 1.0},
        }
        script = f"echo {seed} >> {self.notes}; echo '{json.dumps(said)}'"
        return contextlib.nullcontext(Command(("sh", "-c", script), (), {}))

    def about(self) -> dict[str, Any]:
        return {"device": "none"}


def test_a_campaign_counts_what_succeeds_and_names_what_does_not(tmp_path: Path) -> None:
    case = Recounted("mine", tmp_path / "notes")
    (figures,) = measure([case], Campaign(4, 10.0, 2), lambda _done: None)
    assert (figures["episodes"], figures["succeeded"], figures["share"]) == (4, 2, 0.5)
    assert figures["passed"] is False
    assert [missed["seed"] for missed in figures["missed"]] == [1, 3]
    assert figures["device"] == "none"


@dataclass(frozen=True)
class Broken(Recounted):
    """A case whose run fails, while its recorder ends in good order."""

    def prepared(self, seed: int) -> contextlib.AbstractContextManager[Command]:
        script = "echo 'fulmar: no base answers' >&2; echo '[recorder] recorded 9 messages' >&2; exit 3"
        return contextlib.nullcontext(Command(("sh", "-c", script), (), {}))


def test_a_run_without_figures_is_reported_with_how_it_ended_and_what_was_wrong(tmp_path: Path) -> None:
    (figures,) = measure([Broken("mine", tmp_path)], Campaign(1, 10.0, 1), lambda _done: None)
    (missed,) = figures["missed"]
    assert missed["failure"] == "it ended with 3, and last said: fulmar: no base answers"


def test_a_campaign_that_was_broken_off_goes_on_where_it_was(tmp_path: Path) -> None:
    case, kept = Recounted("mine", tmp_path / "notes"), tmp_path / "kept"
    kept.mkdir()
    done = Episode(FIRST_SEED, True, None, 0.01, 0, 1.0)
    (kept / f"mine_10s_{FIRST_SEED}.json").write_text(json.dumps(asdict(done)))
    (figures,) = measure([case], Campaign(2, 10.0, 1, kept), lambda _done: None)
    assert figures["succeeded"] == 2
    assert case.notes.read_text().split() == ["2"]
    measure([case], Campaign(2, 10.0, 1, kept), lambda _done: None)
    assert case.notes.read_text().split() == ["2"]


def test_a_device_without_an_emulator_is_reported_with_the_nearest() -> None:
    assert [case.name for case in cases_of(None)] == [case.name for case in CASES]
    with pytest.raises(UnknownNameError, match="Did you mean 'kingfisher'"):
        cases_of(["kingfishr"])
