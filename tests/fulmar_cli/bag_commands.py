"""`fulmar bag` as a person asks it, and the reference bags to ask about."""

from __future__ import annotations

import json
from pathlib import Path

from typer.testing import CliRunner

from fulmar_cli.main import app

BAGS = Path(__file__).resolve().parents[1] / "replay" / "bags"
POLICY, LQR = BAGS / "floating_platform_go_to_pose_policy", BAGS / "floating_platform_go_to_pose_lqr"


def ask(*words: object):
    return CliRunner().invoke(app, ["bag", *map(str, words)])


def answer(*words: object) -> dict:
    done = ask(*words, "--json")
    assert done.exception is None or isinstance(done.exception, SystemExit), done.exception
    return json.loads(done.stdout[done.stdout.index("{") :])


def file_of(bag: Path) -> Path:
    return next(bag.glob("*.mcap"))
