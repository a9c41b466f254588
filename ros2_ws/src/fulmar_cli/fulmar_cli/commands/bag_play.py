"""`fulmar bag play`: publish a bag on ROS again, or show it in X-Plane."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

from fulmar_bringup.console import print_json, warn, write_line
from fulmar_cli.commands.arguments import BagArgument, JsonOption, flag, option
from fulmar_cli.commands.damage import finish, open_and_warn
from fulmar_core.config.errors import ConfigError, UnknownNameError

if TYPE_CHECKING:
    from fulmar_bags.contents import Bag

PLACES = ("ros", "xplane")
TO_HELP = "ros: publish the messages. xplane: show the robot in X-Plane by its plugin XPlaneConnect; physics is paused."
WAIT_S, HOST, PORT = 0.5, "127.0.0.1", 49009


def play(
    bag: BagArgument,
    to: Annotated[str, option("ros|xplane", TO_HELP, "--to")] = "ros",
    rate: Annotated[float, option("F", "Seconds of the run in a wall-clock second.", min=0.001)] = 1.0,
    start: Annotated[float, option("S", "Begin so far into the run [s].", min=0.0)] = 0.0,
    loop: Annotated[bool, flag("--loop", "Begin again at the end, until Ctrl-C.")] = False,
    clock: Annotated[bool, flag("--clock", "Publish /clock with the time of the run.")] = False,
    topic: Annotated[
        list[str] | None,
        option(
            "TOPIC",
            "This topic alone, such as odom; may be repeated. All by default; in X-Plane the robot's odometry.",
        ),
    ] = None,
    wait: Annotated[
        float | None, option("S", "Wait before the first message, for discovery; 0.5 by default.", min=0.0)
    ] = None,
    host: Annotated[str | None, option("HOST", f"Of X-Plane; {HOST} by default.")] = None,
    port: Annotated[int | None, option("N", f"Of its plugin; {PORT} by default.", min=1, max=65535)] = None,
    as_json: JsonOption = False,
) -> None:
    """Publish recorded messages, byte for byte, at the pace of the run; or show its poses in X-Plane.

    The pace is that of the stamps: a lock-step run, recorded in a second, plays for as long as it lasted. Goals and
    other latched messages from before --start are published at the start. With --loop time jumps back, as with a
    restarted plant.

    Try, with a controller listening: fulmar bag play runs/demo_x/lqr --topic odom --topic goal_pose --clock

    With X-Plane on another computer: fulmar bag play runs/flight --to xplane --host 192.168.1.20 --rate 0.5
    """
    from fulmar_cli.installation.extras import require

    _check(to, for_ros=clock or wait is not None, for_xplane=host is not None or port is not None)
    require("rclpy" if to == "ros" else "serial")
    opened = open_and_warn(bag)
    if to == "xplane":
        address = f"udp://{host or HOST}:{port or PORT}"
        document, words = _shown(opened, address, topics=topic, start_s=start, rate=rate, loop=loop)
    else:
        wait_s = WAIT_S if wait is None else wait
        more: dict[str, Any] = {"rate": rate, "loop": loop, "clock": clock, "wait_s": wait_s}
        document, words = _published(opened, topics=topic, start_s=start, **more)
    if as_json:
        print_json({"bag": str(bag), "rate": rate, **document})
    else:
        write_line(words)
    raise finish(opened)


def _check(to: str, *, for_ros: bool, for_xplane: bool) -> None:
    """Refuse an unknown place, and options of the other one."""
    if to not in PLACES:
        raise UnknownNameError("--to", to, PLACES)
    if to == "xplane" and for_ros:
        raise ConfigError("--clock and --wait go with --to ros. Leave them out.")
    if to == "ros" and for_xplane:
        raise ConfigError("--host and --port go with --to xplane. Add it, or leave them out.")


def _published(
    opened: Bag, *, topics: list[str] | None, start_s: float, rate: float, **more: Any
) -> tuple[dict[str, Any], str]:
    """Publish a bag on ROS; returns the result as JSON and in words."""
    from fulmar_bringup.player import play as publish
    from fulmar_bringup.player import schedule

    plan = schedule(opened, topics=topics, start_s=start_s)
    done = publish(plan, opened, rate=rate, **more)
    warn(f"{name} was left out: its type is not installed" for name in done.left_out)
    duration_s = (plan.end_ns - plan.begin_ns) / 1e9
    words = (
        f"played {done.messages} messages of {duration_s:.2f} s at {rate:g} times the pace, p99 of lateness "
        f"{done.late_ms_p99:.1f} ms"
    )
    return {"duration_s": duration_s, **vars(done)}, words


def _shown(
    opened: Bag, address: str, *, topics: list[str] | None, start_s: float, rate: float, loop: bool
) -> tuple[dict[str, Any], str]:
    """Show a bag in X-Plane; returns the result as JSON and in words."""
    from fulmar_bringup.xplane_player import film_of, show

    film = film_of(opened, topics=topics, start_s=start_s)
    if film.left_out:
        warn([f"{film.left_out} poses were left out: they are not finite, or not later than the one before"])
    done = show(film, address, rate=rate, loop=loop)
    words = (
        f"showed {done.poses} poses of {film.duration_s:.2f} s at {rate:g} times the pace, p99 of lateness "
        f"{done.late_ms_p99:.1f} ms; X-Plane stays paused: its key P lets it go on"
    )
    return {"duration_s": film.duration_s, "left_out": film.left_out, **vars(done)}, words
