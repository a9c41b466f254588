"""`fulmar console`: a page in the browser that shows robots, takes goals and stops them; and that plays bags."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from fulmar_bringup.console import print_json, write_line
from fulmar_cli.commands.arguments import JsonOption, argument, flag
from fulmar_cli.commands.console_options import ListenOption, PortOption, TokenOption, token_of
from fulmar_cli.installation.extras import require
from fulmar_console import ADDRESS, PORT
from fulmar_core.config.errors import ConfigError

if TYPE_CHECKING:
    from fulmar_console.source import Source

MOST_BAGS = 2


def console(
    bags: Annotated[
        list[Path] | None, argument("[BAG [BAG]]", "Bags to play, two beside each other; none: what runs.")
    ] = None,
    port: PortOption = PORT,
    listen: ListenOption = ADDRESS,
    token: TokenOption = None,
    browser: Annotated[bool, flag("--open", "Open the page in the browser of this computer.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Show the robots of this ROS domain on a page in the browser, or play bags there, until Ctrl-C.

    The page shows each robot with what its actuators do, its goal and why it stopped. A person drags a goal, chooses a
    controller, drives by keys, disturbs a simulation, and stops one robot or all: with the red button, or Esc. What the
    page does goes through topics and services; closing it changes nothing on a robot, except that one that is driven by
    hand stops.

    It listens on this computer alone. With --listen another address takes a token, which the printed address has;
    stopping needs none. See docs/console.md.

    Try:

    fulmar console

    fulmar console runs/first

    fulmar console runs/first runs/second          # both in one scene, with their difference

    fulmar up mujoco_policy --console              # starts a system and its page
    """
    played = tuple(bags or ())
    require("websockets", "mcap" if played else "rclpy")
    from fulmar_console.process import ConsoleRequest, bound, rules, serve

    if len(played) > MOST_BAGS:
        raise ConfigError(f"{len(played)} bags are given; the page plays one, or two beside each other.")
    request = ConsoleRequest(address=listen, port=port, token=token_of(token))

    def say(address: str) -> None:
        if as_json:
            print_json({"url": address}, indent=None)
        else:
            write_line(f"console: {address}   (Ctrl-C ends it)")
        if browser:
            import webbrowser

            webbrowser.open(address)

    with bound(listen, port) as listening:
        serve(_source(played), listening, rules(request, listening), say)


def _source(bags: tuple[Path, ...]) -> Source:
    """Bags, or robots that run."""
    if bags:
        from fulmar_console.bags.bag_source import BagSource

        return BagSource(bags)
    from fulmar_console.live.live_source import LiveSource

    return LiveSource()
