"""`fulmar bag`: inspect, re-run, compare and convert recorded bags."""

from __future__ import annotations

import typer

from fulmar_cli.commands.bag_diff import diff
from fulmar_cli.commands.bag_export import export
from fulmar_cli.commands.bag_info import info
from fulmar_cli.commands.bag_play import play
from fulmar_cli.commands.bag_plot import plot
from fulmar_cli.commands.bag_recover import recover
from fulmar_cli.commands.bag_reference import reference
from fulmar_cli.commands.bag_rerun import rerun

EPILOG = """\b
Any rosbag2 folder with MCAP or sqlite3 will do, or one file of it; nothing here needs ROS but `play` and
`rerun --through node`. Of a damaged bag, everything that can be read is read, and the rest is named.

Exit codes of all: 0 done and the same. 1 something differs, there was nothing to compare, or part of a bag could not
be read; what could be was done all the same. 2 there is no bag, nothing of it can be read, or the command was wrong.
"""

bag = typer.Typer(
    help="Inspect bags, re-run them with another controller, compare and export them.",
    no_args_is_help=True,
    rich_markup_mode=None,
    epilog=EPILOG,
)
bag.command()(info)
bag.command()(rerun)
bag.command()(diff)
bag.command()(export)
bag.command()(recover)
bag.command()(reference)
bag.command()(play)
bag.command()(plot)
