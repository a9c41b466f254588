"""`fulmar view`: robots that run, or a bag, for another program's viewer."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from fulmar_bringup.console import print_json, warn, write_line
from fulmar_cli.commands.arguments import JsonOption, argument, flag, option
from fulmar_core.config.errors import ConfigError

PORT = 8765  # where Foxglove looks first


def view(
    bag: Annotated[Path | None, argument("[BAG]", "A bag to play, again and again; none: what runs.")] = None,
    foxglove: Annotated[bool, flag("--foxglove", "For Foxglove: a websocket that its app opens.")] = False,
    port: Annotated[int, option("N", "Port on this computer; 0: any that is free.")] = PORT,
    rate: Annotated[float, option("X", "Of a bag: seconds of the recording a second.")] = 1.0,
    as_json: JsonOption = False,
) -> None:
    """Show the robots of this ROS domain, or a bag, in Foxglove, until Ctrl-C.

    It publishes a scene (bodies, trails, goals, things), frames, poses, curves, images and what happened, as Foxglove's
    own schemas, so that no plugin is needed. Nothing can be commanded through it: that is what `fulmar console` is for.
    It listens on this computer alone, and needs the extra 'foxglove'.

    In Foxglove: Open connection, Foxglove WebSocket, and the address that is printed.

    Exit code: 0 ended by Ctrl-C, 2 no such bag, or the port is taken.

    Try:

    fulmar view --foxglove

    fulmar view --foxglove runs/first
    """
    if not foxglove:
        raise ConfigError(
            "name the viewer: fulmar view --foxglove. The page of Fulmar itself is `fulmar console`."
        )
    if rate <= 0.0:
        raise ConfigError(f"--rate {rate:g}: must be above 0.")
    from fulmar_console.exports.foxglove_server import serve_bag, serve_live

    def say(address: str) -> None:
        if as_json:
            print_json({"url": address}, indent=None)
        else:
            write_line(f"foxglove: {address}   (Ctrl-C ends it)")

    try:
        if bag is None:
            serve_live(port, say)
        else:
            serve_bag(bag, port, rate, say, warn)
    except KeyboardInterrupt:
        return
