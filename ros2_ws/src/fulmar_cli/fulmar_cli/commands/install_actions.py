"""`fulmar install-actions`: the messages of Nav2's actions, where ROS comes as wheels."""

from __future__ import annotations

from fulmar_bringup.console import log_line, print_json, write_line
from fulmar_cli.commands.arguments import JsonOption


def install_actions(as_json: JsonOption = False) -> None:
    """Build nav2_msgs and install it beside ROS's wheels, for `--actions` of `fulmar up` and `fulmar run`.

    Where ROS's own nav2_msgs is installed, that is used, and this does nothing. Elsewhere it takes one to two minutes,
    a C++ compiler and the headers of Python.

    Try:

    fulmar install-actions

    fulmar up mujoco_lqr --actions
    """
    from fulmar_bringup.message_build import NAV2_MSGS, install_messages

    built = install_messages(NAV2_MSGS, log_line)
    if as_json:
        print_json({"package": NAV2_MSGS, "built": built})
    else:
        write_line("nav2_msgs is installed" if built else "nav2_msgs is there already")
