"""`fulmar bundle`: show, sign and check policy bundles."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fulmar_bringup.console import print_json, warn, write_line
from fulmar_cli.commands.arguments import JsonOption, argument, option
from fulmar_cli.commands.envelope import RequireEnvelopeOption

bundle = typer.Typer(help="Show, sign and check policy bundles.", no_args_is_help=True, rich_markup_mode=None)
FolderArgument = Annotated[Path, argument("DIR", "A policy bundle.")]


@bundle.command()
def show(folder: FolderArgument, as_json: JsonOption = False) -> None:
    """Show the passport of a bundle."""
    from fulmar_core.loop.policy_bundle import read_passport

    passport = read_passport(folder).plain()
    if as_json:
        print_json(passport)
        return
    training, certified = passport.pop("training"), passport.pop("envelope", None)
    lines = {
        key: ", ".join(map(str, value)) if isinstance(value, tuple) else value
        for key, value in passport.items()
    }
    lines |= {
        f"trained: {key}": value for key, value in training.items() if not isinstance(value, dict | list)
    }
    if certified:
        tested = f"{certified['successes']} of {certified['episodes']} episodes"
        lines["certified"] = (
            f"at least {certified['lower_bound']:.3f} ({tested}); `fulmar bundle check` compares"
        )
    curve = [f"{check['success_rate']:.3f}" for check in training.get("curve", ())]
    if curve:
        lines["trained: success"] = f"{curve[0]} to {curve[-1]} in {len(curve)} checks"
    width = max(map(len, lines))
    for key, value in lines.items():
        write_line(f"{key:<{width}}  {value}")


@bundle.command()
def keys(
    private: Annotated[Path, argument("PRIVATE", "File for the private key; keep it secret.")],
    public: Annotated[Path, argument("PUBLIC", "File for the public key, for robots.")],
) -> None:
    """Make a pair of ed25519 keys: one to sign bundles, one for robots to check them by."""
    from fulmar_cli.installation.extras import require

    require("cryptography")
    from fulmar_core.loop.bundle_signature import make_keys

    make_keys(private, public)
    write_line(f"sign with {private}, give {public} to robots")


@bundle.command()
def sign(
    folder: FolderArgument,
    key: Annotated[Path, option("FILE", "A private key of `fulmar bundle keys`.")],
) -> None:
    """Sign a bundle, whose hashes are checked first."""
    from fulmar_cli.installation.extras import require

    require("cryptography")
    from fulmar_core.loop.bundle_signature import sign_bundle

    sign_bundle(folder, key)
    write_line(f"{folder}: signed")


@bundle.command()
def verify(
    folder: FolderArgument,
    trusted: Annotated[Path, option("FILE|DIR", "A public key, or a folder of them (*.pem).")],
    as_json: JsonOption = False,
) -> None:
    """Check that a trusted key has signed a bundle, and that nothing was changed since."""
    from fulmar_cli.installation.extras import require

    require("cryptography")
    from fulmar_core.loop.bundle_signature import verify_bundle
    from fulmar_core.loop.policy_bundle import read_bundle

    found = read_bundle(folder)
    name = verify_bundle(found, trusted)
    if as_json:
        print_json({"bundle": str(folder), "signed_by": name, "sha256": found.passport.sha256})
    else:
        write_line(f"{folder}: signed by {name}")


@bundle.command()
def check(
    folder: FolderArgument, require_envelope: RequireEnvelopeOption = False, as_json: JsonOption = False
) -> None:
    """Load a bundle as the robot would: hashes, robot, task, rate, names, shapes, golden vectors, certified set."""
    from fulmar_bringup.envelope_check import beyond_box, envelope_note, other_core
    from fulmar_bringup.plan_checks import checked_rate
    from fulmar_core.loop.policy_bundle import read_passport
    from fulmar_core.robots.robot_file import load_robot
    from fulmar_core.tasks import load_task
    from policy_server.policy import Policy

    passport = read_passport(folder)
    robot, task = load_robot(passport.robot), load_task(passport.task)
    checked_rate(robot, passport.control_hz)
    Policy(folder, robot, task, control_hz=passport.control_hz)
    note = envelope_note(str(folder), robot, task.name, required=require_envelope)
    older, certified = other_core(folder), passport.envelope is not None
    state = "none" if not certified else "outside" if note else "inside"
    beyond = beyond_box(folder, robot, task.name) if certified and not note else ()
    warn([line for line in (note, older and f"policy '{folder}': of its certified set: {older}") if line])
    if as_json:
        document = {"bundle": str(folder), "accepted": True, "sha256": passport.sha256}
        print_json({**document, "envelope": state, "beyond_box": list(beyond)})
    else:
        write_line(f"{folder}: accepted ({passport.robot}, {passport.task}, {passport.control_hz:g} Hz)")
        if certified:
            write_line(
                f"certified set: {robot.name} is {state}{''.join(f'; {part} of its box' for part in beyond)}"
            )
