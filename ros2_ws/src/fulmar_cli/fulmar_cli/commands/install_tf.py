"""`fulmar install-tf`: the message package of /tf, where ROS comes as wheels."""

from __future__ import annotations

from fulmar_bringup.console import log_line, print_json, write_line
from fulmar_cli.commands.arguments import JsonOption


def install_tf(as_json: JsonOption = False) -> None:
    """Build tf2_msgs and install it beside ROS's wheels, so that /tf and /tf_static are published.

    On a Jazzy machine ROS's own tf2_msgs is used, and this does nothing. Elsewhere it takes one to two minutes, a C++
    compiler and the headers of Python. Without it everything runs, but RViz and Foxglove get no frames.

    Try:

    fulmar install-tf

    fulmar up mujoco_lqr
    """
    from fulmar_bringup.message_build import TF2_MSGS, install_messages

    built = install_messages(TF2_MSGS, log_line)
    if as_json:
        print_json({"package": "tf2_msgs", "built": built})
    else:
        write_line("tf2_msgs is installed" if built else "tf2_msgs is there already")
