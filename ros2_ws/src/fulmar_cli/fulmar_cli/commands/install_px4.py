"""`fulmar install-px4`: the messages of PX4, where ROS comes as wheels."""

from __future__ import annotations

from fulmar_bringup.console import log_line, print_json, write_line
from fulmar_cli.commands.arguments import JsonOption


def install_px4(as_json: JsonOption = False) -> None:
    """Build px4_msgs and install it beside ROS's wheels, for the drivers `px4_thrusters` and `px4_wing`.

    Eleven messages of release 1.16. Where px4_msgs is installed, that is used, and this does nothing. Elsewhere it
    takes one to two minutes, a C++ compiler and the headers of Python.

    Try:

    fulmar install-px4

    fulmar run modular_freeflyer --backend hardware --hardware modular_freeflyer_px4 --emulate --arm --goal 1,0
    """
    from fulmar_bringup.message_build import PX4_MSGS, install_messages

    built = install_messages(PX4_MSGS, log_line)
    if as_json:
        print_json({"package": PX4_MSGS, "built": built})
    else:
        write_line("px4_msgs is installed" if built else "px4_msgs is there already")
