"""The steps of a twin: identify, evaluate, train, evaluate again, re-run the bags, report."""

from __future__ import annotations

import json
import shutil
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from fulmar_bringup.envelope_check import envelope_problems
from fulmar_core.config.errors import ConfigError
from fulmar_core.config.process import environment
from fulmar_core.config.seeds import EVALUATION_SEED
from fulmar_core.loop.policy_bundle import read_passport
from fulmar_core.robots.calibration import VARIABLE, save_calibration
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task
from fulmar_evaluation.identified_bags import IdentifiedRobot, identify_bags
from fulmar_evaluation.trial_plan import plan_trial, trial_figures
from fulmar_evaluation.twin.bag_answers import bag_answers
from fulmar_evaluation.twin.report import page_of, report_of
from fulmar_evaluation.twin.request import TwinRequest
from fulmar_evaluation.twin.steps import Say, Steps, hash_of, hashes
from fulmar_evaluation.twin.training import train_bundle, training_job

STEPS = ("identification", "old_bundle", "training", "new_bundle", "bags", "report")
# Without these the robot of the YAML would be evaluated in place of the one that drove.
NEEDED = (
    *("thrust", "mass", "roll_inertia", "pitch_inertia", "yaw_inertia", "delay"),
    *("wheel_scale", "turn_scale"),
)
CALIBRATION, PAGE = "calibration.yaml", "report.md"


@dataclass(frozen=True)
class _Work:
    """A request on its way."""

    request: TwinRequest
    steps: Steps

    @property
    def calibration(self) -> Path:
        return self.request.out / CALIBRATION

    @property
    def bundle(self) -> Path:
        """Of the training; in a folder of its own, since the name is that of the pair."""
        return self.request.out / "bundles" / f"{self.request.robot}_{self.request.task}"


def run_twin(request: TwinRequest, say: Say) -> dict[str, Any]:
    """Do every step that is not done yet.

    Args:
        request: Checked.
        say: Receives a line for each step.

    Returns:
        The report, ready for JSON, as in `report.json` of the folder; the page `report.md` has the same for people.

    Raises:
        FulmarError: A bag, the bundle or the training cannot be used; the folder keeps the steps before it.
    """
    work = _Work(request, Steps(request.out, STEPS, say))
    work.steps.begin()
    identification = _identified(work)
    with environment({VARIABLE: str(work.calibration.absolute())}):
        old = _evaluated(work, "old_bundle", request.policy)
        training = _trained(work, old)
        new = _evaluated(work, "new_bundle", work.bundle) if training["trained"] else None
    bags = _bags(work) if training["trained"] else []
    report = report_of(request, identification, old, training, new, bags)
    page = request.out / PAGE

    def write() -> dict[str, Any]:
        page.write_text(page_of(report), encoding="utf-8")
        return report

    return work.steps.take("report", {"steps": hash_of(json.dumps(report))}, write, (page,))


def accept(request: TwinRequest, report: dict[str, Any]) -> bool:
    """Copy the new bundle to its place, where it is better than the old one; whether it was copied.

    Args:
        request: Of the twin.
        report: Its result.

    Raises:
        ConfigError: No place was given.
    """
    if request.bundle is None:
        raise ConfigError("--accept writes a bundle: say where, with --bundle DIR.")
    if not report["better"]:
        return False
    shutil.copytree(report["new"]["bundle"], request.bundle, dirs_exist_ok=True)
    read_passport(request.bundle)  # every hash
    return True


def _identified(work: _Work) -> dict[str, Any]:
    """Estimates of the robot, and the calibration file."""
    request = work.request
    with environment(
        {VARIABLE: ""}
    ):  # what is measured is compared with the YAML, not with an older calibration
        robot = repr(load_robot(request.robot))
    made_from = {
        "bags": hashes(request.bags),
        "known": list(request.known),
        "ballast": list(request.ballast),
        "reading": asdict(request.reading),
        "robot": hash_of(robot),
    }

    def identify() -> dict[str, Any]:
        with environment({VARIABLE: ""}):
            found = identify_bags(
                request.bags, known=request.known, ballast=request.ballast, reading=request.reading
            )
        _check_shown(found)
        save_calibration(found.calibration, work.calibration)
        return found.document(work.calibration) | _beside(found)

    return work.steps.take("identification", made_from, identify, (work.calibration,))


def _check_shown(found: IdentifiedRobot) -> None:
    """Reject bags that leave open what a policy depends on most."""
    open_ones = [name for name in found.found.undetermined if name in NEEDED]
    if open_ones:
        name, open_text = found.robot.name, ", ".join(open_ones)
        raise ConfigError(
            f"the bags do not show {open_text} of '{name}': {found.driven_s:.1f} s are too short, or it hardly moved. "
            f"Drive for longer: fulmar run {name} --controller excite --duration 120"
        )


def _beside(found: IdentifiedRobot) -> dict[str, Any]:
    """What the estimates are compared with, and the noise with its intervals."""
    identified, fit = found.found, found.found.fit
    noise = {
        name: {"value": fit.noise[i], **dict(zip(("low", "high"), fit.noise_interval(i), strict=True))}
        for i, name in enumerate(identified.channels)
    }
    return {
        "nominal": dict(identified.nominal),
        "noise": noise,
        "measurements": fit.measurements,
        "trusted": identified.trusted,
        "warnings": list(found.warnings),
    }


def _evaluated(work: _Work, step: str, bundle: Path) -> dict[str, Any]:
    """Figures of a bundle in MuJoCo, on the robot as it was identified."""
    request, passport = work.request, read_passport(bundle)
    made_from = {
        **_same(work),
        "bundle": passport.sha256,
        "task": hash_of(repr(load_task(request.task))),
        "episodes": request.episodes,
        "seed": EVALUATION_SEED,
    }

    def evaluate() -> dict[str, Any]:
        trial = plan_trial(
            robot=request.robot, task=request.task, controller="policy", policy=bundle, through="mujoco",
            episodes=request.episodes, seed=EVALUATION_SEED, scenario="nominal", control_hz=None, jobs=None,
            episode_s=None, steps=None, worlds=None, bounds=None,
        )  # fmt: skip
        beside = {"bundle": str(bundle), "sha256": passport.sha256, "envelope": _envelope(work, bundle)}
        return {**trial_figures(trial), **beside}

    return work.steps.take(step, made_from, evaluate)


def _envelope(work: _Work, bundle: Path) -> dict[str, Any] | None:
    """Whether the robot as it was identified lies inside the certified set of a bundle; None without a set."""
    if read_passport(bundle).envelope is None:
        return None
    problems = envelope_problems(bundle, load_robot(work.request.robot), work.request.task)
    return {"inside": not problems, "problems": list(problems)}


def _trained(work: _Work, old: dict[str, Any]) -> dict[str, Any]:
    """A new bundle, where the old one has fallen."""
    request = work.request
    rate, least = old["success_rate"], request.retrain_below
    if rate >= least:
        kept = {"trained": False, "reason": f"the old bundle succeeds in {rate:.3f}, at least {least:g}"}
        return work.steps.take("training", {"old": rate, "retrain_below": least}, lambda: kept)
    runs = request.out / "training"
    job = training_job(
        request.robot, request.task, updates=request.updates, runs=runs, bundles=work.bundle.parent,
        command=request.command,
    )  # fmt: skip
    made_from = {**_same(work), "recipe": job.recipe, "updates": job.updates, "seed": job.seed}
    return work.steps.take(
        "training", made_from, lambda: {"trained": True, **train_bundle(job)}, (work.bundle,)
    )


def _bags(work: _Work) -> list[dict[str, Any]]:
    """Answers of both bundles to the bags."""
    request = work.request
    bundles = [read_passport(folder).sha256 for folder in (request.policy, work.bundle)]
    made_from = {"bags": hashes(request.bags), "bundles": bundles, "reading": asdict(request.reading)}

    def answer() -> dict[str, Any]:
        found = bag_answers(
            request.bags, request.policy, work.bundle, task=request.task, reading=request.reading
        )
        return {"bags": found}

    return list(work.steps.take("bags", made_from, answer)["bags"])


def _same(work: _Work) -> dict[str, Any]:
    """The robot as it was identified, of which everything after it depends."""
    return {"robot": hash_of(repr(load_robot(work.request.robot)))}
