"""`fulmar bag export`: bags for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from fulmar_bags.bag_reading import BagReading
from fulmar_bringup.console import print_json, warn, write_line
from fulmar_cli.commands.arguments import JsonOption, argument, option
from fulmar_cli.commands.bag_reading import with_bag_options
from fulmar_cli.commands.damage import finish, open_and_warn
from fulmar_core.config.errors import BagError, ConfigError, UnknownNameError

if TYPE_CHECKING:
    from fulmar_bags.contents import Bag

FORMATS = ("csv", "npz", "lerobot", "frames", "rerun", "foxglove")
VIEWED = {"rerun": ".rrd", "foxglove": ".foxglove.mcap"}  # ending of what a viewer opens


@with_bag_options()
def export(
    bags: Annotated[list[Path], argument("BAG...", "Bags; several only for lerobot.")],
    to: Annotated[
        str,
        option(
            "csv|npz|lerobot|frames|rerun|foxglove",
            "csv: a table for each topic. npz: NumPy arrays, one for each field. lerobot: a dataset, one episode "
            "for each bag, one frame for each control step. frames: the images of cameras as JPEG and PNG, with a "
            "table of when and where each was taken. rerun, foxglove: a file that the viewer opens, with robots, "
            "trails, goals, curves, images and what happened.",
            "--to",
        ),
    ] = "csv",
    out: Annotated[
        Path | None, option("PATH", "Folder, or the .npz file; beside the bag by default.")
    ] = None,
    as_json: JsonOption = False,
    *,
    reading: BagReading,
) -> None:
    """Write what is in a bag as CSV, as NumPy arrays, as images, for other viewers, or as a dataset to learn from.

    The dataset follows version 3.0 of LeRobot's format: `meta/info.json`, `meta/stats.json`, tasks, episodes and frames
    as parquet, with `observation.state` and `action` as the controller received and sent them. Images of cameras go
    along: colours as video, depth and segmentation as 16-bit PNG. It needs the extra 'datasets'; rerun and foxglove
    need those of their names.
    """
    from fulmar_bags.tables import write_csv, write_npz

    if to not in FORMATS:
        raise UnknownNameError("--to", to, FORMATS)
    if len(bags) > 1 and to != "lerobot":
        raise ConfigError(f"--to {to} takes one bag, {len(bags)} were given. Export them one by one.")
    if to in VIEWED:
        _write_viewed(bags[0], to, out, as_json=as_json)
        return
    opened = [open_and_warn(bag, reading) for bag in bags]
    beside = bags[0] if bags[0].is_dir() else bags[0].parent
    if to == "csv":
        files, left_out = write_csv(opened[0], out or beside / "csv")
    elif to == "npz":
        path = out or beside / f"{beside.resolve().name}.npz"
        file, left_out = write_npz(opened[0], path.with_suffix(".npz"))
        files = [file]
    elif to == "frames":
        from fulmar_bags.frame_files import write_frames

        file, left_out = write_frames(opened[0], out or beside / "frames")
        files = [file]
    else:
        folder, notes = _write_dataset(opened, out or beside / "lerobot")
        files, left_out = [folder], []
        warn(notes)
    warn(f"left out: {line}" for line in left_out)
    if as_json:
        names = [str(file) for file in files]
        print_json({"bags": [str(bag) for bag in bags], "to": to, "files": names, "left_out": left_out})
    else:
        for file in files:
            write_line(str(file))
    raise finish(*opened)


def _write_viewed(bag: Path, to: str, out: Path | None, *, as_json: bool) -> None:
    """Write and name the file of a viewer, for one bag or the bags of one system."""
    if to == "rerun":
        from fulmar_console.exports.rerun_file import write_rerun as write
    else:
        from fulmar_console.exports.foxglove_file import write_foxglove as write
    from fulmar_console.bags.paths import bags_of
    from fulmar_console.bags.recording import read_recording

    paths = bags_of(bag)
    folder = bag if bag.is_dir() else bag.parent
    path = out or folder.resolve().with_name(f"{folder.resolve().name}{VIEWED[to]}")
    recording = read_recording(paths, folder.resolve().name, lambda _share, _words: None)
    warn(recording.document["notes"])
    file = write(recording, path)
    if as_json:
        print_json({"bags": [str(each) for each in paths], "to": to, "files": [str(file)], "left_out": []})
    else:
        write_line(str(file))


def _write_dataset(opened: list[Bag], out: Path) -> tuple[Path, list[str]]:
    """The folder of a dataset for LeRobot, and notes."""
    from fulmar_bags.control_steps import control_steps_of
    from fulmar_bags.lerobot import write_lerobot
    from fulmar_bags.lerobot_images import seen_in
    from fulmar_evaluation.rerun.embedded_configs import knowing_what_it_carries

    for bag in opened:
        if bag.info is None:
            raise BagError(
                f"{bag.path}: others recorded it, without the observations of a controller. "
                "Use --to csv, npz or frames."
            )
    with knowing_what_it_carries(*opened):
        records = [control_steps_of(bag) for bag in opened]
        titles = [record.task.title for record in records]
        seen = [seen_in(bag) for bag in opened]
        return write_lerobot(records, titles, out, seen)
