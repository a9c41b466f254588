"""`fulmar install-interfaces`: the messages of standards that Fulmar serves, where ROS comes as wheels."""

from __future__ import annotations

from fulmar_bringup.console import log_line, print_json, write_line
from fulmar_cli.commands.arguments import JsonOption


def install_interfaces(as_json: JsonOption = False) -> None:
    """Build nav2_msgs, simulation_interfaces, control_msgs and px4_msgs, and install them beside ROS's wheels.

    They are for `--actions`, `--simulation-interfaces` and `--broadcast` of `fulmar up` and `fulmar run`, and for the
    drivers of PX4. Where ROS's own packages are installed, those are used. Elsewhere it takes two to three minutes, a
    C++ compiler and the headers of Python.

    Try:

    fulmar install-interfaces

    fulmar up mujoco_lqr --simulation-interfaces
    """
    from fulmar_bringup.message_build import PACKAGES, TF2_MSGS, install_messages

    packages = tuple(
        package for package in PACKAGES if package != TF2_MSGS
    )  # that one has a command of its own
    built = install_messages(packages, log_line)
    if as_json:
        print_json({"packages": packages, "built": built})
    else:
        write_line(f"{', '.join(packages)} are {'installed' if built else 'there already'}")
