"""The controllers that go through a recorded run again: the chosen one, its fallback, and who took over."""

from __future__ import annotations

from fulmar_bags.control_steps import ControlSteps
from fulmar_core.controllers.classical import load_classical
from fulmar_core.controllers.controller import Controller
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
        follow: Whether policies that took over in the record take over again.

    Returns:
        Its answers, and the SHA-256 of what defines it.

    Raises:
        FulmarError: It cannot be loaded, or as `rerun` says.
    """
    hz = record.settings.control_rate(record.robot)

    def load(bundle: str) -> Controller:
        settings = record.settings
        choice = Choice(hz, bundle, excitation=settings.excitation, seed=settings.seed)
        return load_controller(name, record.robot, record.task, choice)

    law, fallback = record.settings.fallback, None
    if controller_entry(name).runs_bundle and law:  # nothing else has one in the node
        law_of = None if law == "classical" else law
        fallback = load_classical(record.robot, record.task, control_hz=hz, law=law_of)
    loaded = load(folder)
    answers = rerun(record, loaded, source=source, fallback=fallback, load=load if follow else None)
    return answers, loaded.metadata().get("sha256")
