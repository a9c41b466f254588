"""Options of tasks that fly about a thing in space."""

from __future__ import annotations

from typing import Annotated

from fulmar_cli.commands.arguments import option

ThingOption = Annotated[
    str | None,
    option(
        "NAME",
        "Thing in space in the world of a task of free flyers: gateway, iss, venus_express.",
        "--thing",
    ),
]
PathOption = Annotated[
    str | None,
    option(
        "NAME",
        "Path of inspect or follow_pose_3d: circle, spiral, lissajous and so on.",
        "--path",
    ),
]
