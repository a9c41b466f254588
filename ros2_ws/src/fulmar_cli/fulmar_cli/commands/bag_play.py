"""`fulmar bag play`: publish a bag on ROS again."""

from __future__ import annotations

from typing import Annotated

from fulmar_bringup.console import print_json, warn, write_line
from fulmar_cli.commands.arguments import BagArgument, JsonOption, flag, option
from fulmar_cli.commands.damage import finish, open_and_warn


def play(
    bag: BagArgument,
    rate: Annotated[float, option("F", "Seconds of the run in a wall-clock second.", min=0.001)] = 1.0,
    start: Annotated[float, option("S", "Begin so far into the run [s].", min=0.0)] = 0.0,
    loop: Annotated[bool, flag("--loop", "Begin again at the end, until Ctrl-C.")] = False,
    clock: Annotated[bool, flag("--clock", "Publish /clock with the time of the run.")] = False,
    topic: Annotated[
        list[str] | None, option("TOPIC", "This topic alone, such as odom; may be repeated. All by default.")
    ] = None,
    wait: Annotated[float, option("S", "Wait before the first message, for discovery.", min=0.0)] = 0.5,
    as_json: JsonOption = False,
) -> None:
    """Publish recorded messages, byte for byte, at the pace of the run.

    The pace is that of the stamps: a lock-step run, recorded in a second, plays for as long as it lasted. Goals and
    other latched messages from before --start are published at the start. With --loop time jumps back, as with a
    restarted plant.

    Try, with a controller listening: fulmar bag play runs/demo_x/lqr --topic odom --topic goal_pose --clock
    """
    from fulmar_cli.extras import require

    require("rclpy")
    opened = open_and_warn(bag)
    from fulmar_bringup.player import play as publish
    from fulmar_bringup.player import schedule

    plan = schedule(opened, topics=topic, start_s=start)
    done = publish(plan, opened, rate=rate, loop=loop, clock=clock, wait_s=wait)
    warn(f"{name} was left out: its type is not installed" for name in done.left_out)
    duration_s = (plan.end_ns - plan.begin_ns) / 1e9
    if as_json:
        print_json({"bag": str(bag), "duration_s": duration_s, "rate": rate, **vars(done)})
    else:
        write_line(
            f"played {done.messages} messages of {duration_s:.2f} s at {rate:g} times the pace, p99 of lateness "
            f"{done.late_ms_p99:.1f} ms"
        )
    raise finish(opened)
