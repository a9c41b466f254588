"""`fulmar bag recover`: repair a bag that a power cut or a damaged disk left torn."""

from __future__ import annotations

import typer

from fulmar_bringup.console import print_json, write_line
from fulmar_cli.commands.arguments import BagArgument, JsonOption
from fulmar_core.config.errors import DONE, FAILED, BagError


def recover(bag: BagArgument, as_json: JsonOption = False) -> None:
    """Rewrite the MCAP files of a bag with everything that can be read, and their metadata.yaml.

    Where something could not be read, the old file stays beside the new one, with `.damaged` behind its name. Not for
    a bag that is being recorded.

    Exit code: 0 the bag is whole, 1 something of it is lost, 2 nothing can be read.
    """
    from fulmar_bags.recovery import recover

    if not bag.is_dir():
        raise BagError(f"{bag}: this is no bag folder. Give the folder; all of its files are written anew.")
    lost = recover(bag)
    if as_json:
        print_json({"bag": str(bag), "lost": list(lost)})
    else:
        for line in (*(f"lost: {line}" for line in lost), f"{bag}: every reader of MCAP can open it now"):
            write_line(line)
    raise typer.Exit(FAILED if lost else DONE)
