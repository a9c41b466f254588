"""The controllers that go through a recorded run again: the chosen one, its fallback, and who took over."""

from __future__ import annotations

from fulmar_bags.control_steps import ControlSteps
from fulmar_bags.controller_changes import ControllerChange
from fulmar_core.controllers.classical import load_classical
from fulmar_core.controllers.controller import Controller
from fulmar_core.controllers.rest import Rest
from fulmar_core.loop.controller_choices import FALLBACK, TELEOPERATION
from fulmar_core.loop.controller_settings import POLICY
from fulmar_evaluation.rerun.rerun import Answers, rerun
from policy_server.controllers import Choice, controller_entry, load_controller


def answers_of(
    record: ControlSteps, name: str, folder: str, source: str, *, follow: bool = False
) -> tuple[Answers, str | None]:
    """Let a controller answer a recorded run, with the fallback that the run had.

    Args:
        record: The run.
        name: Of the controller.
        folder: Of its bundle; empty where it has none.
        source: As `rerun` takes it.
        follow: Whether controllers that took over in the record take over again.

    Returns:
        Its answers, and the SHA-256 of what defines it.

    Raises:
        FulmarError: It cannot be loaded, or as `rerun` says.
    """
    hz, settings = record.settings.control_rate(record.robot), record.settings

    def load_named(name: str, bundle: str) -> Controller:
        if name == TELEOPERATION:
            return Rest(record.robot, control_hz=hz, name=name)
        choice = Choice(hz, bundle, excitation=settings.excitation, seed=settings.seed)
        return load_controller(name, record.robot, record.task, choice)

    def load(change: ControllerChange) -> Controller:
        if change.controller == FALLBACK:
            return _fallback(record, hz)
        whose = folder if change.controller == POLICY else change.bundle
        return load_named(change.controller or POLICY, whose)

    # Nothing else has one in the node.
    fallback = _fallback(record, hz) if controller_entry(name).runs_bundle and settings.fallback else None
    loaded = load_named(name, folder)
    answers = rerun(record, loaded, source=source, fallback=fallback, load=load if follow else None)
    return answers, loaded.metadata().get("sha256")


def _fallback(record: ControlSteps, control_hz: float) -> Controller:
    law = record.settings.fallback
    law_of = None if law == "classical" else law
    return load_classical(record.robot, record.task, control_hz=control_hz, law=law_of)
