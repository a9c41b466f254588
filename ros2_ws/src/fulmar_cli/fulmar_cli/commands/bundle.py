"""`fulmar bundle`: look at a policy bundle, or check that it would be accepted."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from fulmar_bringup.console import output, print_json
from fulmar_cli.commands.arguments import JsonOption

bundle = typer.Typer(
    help="Look at policy bundles, and check them.", no_args_is_help=True, rich_markup_mode=None
)
FolderArgument = Annotated[Path, typer.Argument(metavar="DIR", help="A policy bundle.")]


@bundle.command()
def show(folder: FolderArgument, as_json: JsonOption = False) -> None:
    """Show the passport of a bundle."""
    from fulmar_core.policy_bundle import read_passport

    passport = asdict(read_passport(folder))
    if as_json:
        print_json(passport)
        return
    training = passport.pop("training")
    lines = {
        key: ", ".join(map(str, value)) if isinstance(value, tuple) else value
        for key, value in passport.items()
    }
    lines |= {
        f"trained: {key}": value for key, value in training.items() if not isinstance(value, dict | list)
    }
    curve = [f"{check['success_rate']:.3f}" for check in training.get("curve", ())]
    if curve:
        lines["trained: success"] = f"{curve[0]} to {curve[-1]} in {len(curve)} checks"
    width = max(map(len, lines))
    for key, value in lines.items():
        output.print(f"{key:<{width}}  {value}", markup=False, soft_wrap=True)


@bundle.command()
def keys(
    private: Annotated[
        Path, typer.Argument(metavar="PRIVATE", help="File for the private key; keep it secret.")
    ],
    public: Annotated[Path, typer.Argument(metavar="PUBLIC", help="File for the public key, for robots.")],
) -> None:
    """Make a pair of ed25519 keys: one to sign bundles, one for robots to check them by."""
    from fulmar_cli.extras import require

    require("cryptography")
    from fulmar_core.bundle_signature import make_keys

    make_keys(private, public)
    output.print(f"sign with {private}, give {public} to robots", markup=False, soft_wrap=True)


@bundle.command()
def sign(
    folder: FolderArgument,
    key: Annotated[Path, typer.Option(metavar="FILE", help="A private key of `fulmar bundle keys`.")],
) -> None:
    """Sign a bundle, whose hashes are checked first."""
    from fulmar_cli.extras import require

    require("cryptography")
    from fulmar_core.bundle_signature import sign_bundle

    sign_bundle(folder, key)
    output.print(f"{folder}: signed", markup=False, soft_wrap=True)


@bundle.command()
def verify(
    folder: FolderArgument,
    trusted: Annotated[
        Path, typer.Option(metavar="FILE|DIR", help="A public key, or a folder of them (*.pem).")
    ],
    as_json: JsonOption = False,
) -> None:
    """Check that a trusted key has signed a bundle, and that nothing was changed since."""
    from fulmar_cli.extras import require

    require("cryptography")
    from fulmar_core.bundle_signature import verify_bundle
    from fulmar_core.policy_bundle import read_bundle

    found = read_bundle(folder)
    name = verify_bundle(found, trusted)
    if as_json:
        print_json({"bundle": str(folder), "signed_by": name, "sha256": found.passport.sha256})
    else:
        output.print(f"{folder}: signed by {name}", markup=False, soft_wrap=True)


@bundle.command()
def check(folder: FolderArgument, as_json: JsonOption = False) -> None:
    """Load a bundle as the robot would: hashes, robot, task, rate, names, shapes, golden vectors."""
    from fulmar_bringup.plan_checks import checked_rate
    from fulmar_core.policy_bundle import read_passport
    from fulmar_core.robot import load_robot
    from fulmar_core.tasks import load_task
    from policy_server.policy import Policy

    passport = read_passport(folder)
    robot, task = load_robot(passport.robot), load_task(passport.task)
    checked_rate(robot, passport.control_hz)
    Policy(folder, robot, task, control_hz=passport.control_hz)
    if as_json:
        print_json({"bundle": str(folder), "accepted": True, "sha256": passport.sha256})
    else:
        output.print(
            f"{folder}: accepted ({passport.robot}, {passport.task}, {passport.control_hz:g} Hz)",
            markup=False,
        )
