"""`fulmar rates`: turn rates from recorded events of stars."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fulmar_bags.bag_reading import BagReading
from fulmar_bringup.console import log_line, print_result, write_line
from fulmar_bringup.progress import work_bar
from fulmar_cli.commands.arguments import JsonOption, argument, option
from fulmar_cli.commands.bag_reading import with_bag_options
from fulmar_core.config.errors import FAILED, ConfigError

if TYPE_CHECKING:
    from fulmar_evaluation.event_rates import Packet, Rates

SOURCES_HELP = (
    "One bag with packets of events, or a recording for each camera: .h5 or .hdf5 as of DSEC, or .aedat4."
)
ROBOT_HELP = "Satellite whose event cameras it was: their field of view and how they are mounted."
SIZE_HELP = "Pixels of the camera, for files that do not say it."
FOV_HELP = "Field of view of the camera, across its width; the robot's by default."
ESTIMATOR_HELP = "A name from configs/estimators of kind event_rate, or a .yaml file."
BYTES_AN_EVENT = 5.0  # of compressed recordings, about
BAG_HELP = "Write the packets into a bag too, for `fulmar bag play` to feed a live estimator with."


@with_bag_options(robot=False)
def rates(
    sources: Annotated[list[Path], argument("SOURCE...", SOURCES_HELP)],
    robot: Annotated[str, option("R", ROBOT_HELP)] = "cubesat_wheels",
    size: Annotated[str | None, option("WxH", SIZE_HELP)] = None,
    fov: Annotated[float | None, option("DEG", FOV_HELP, min=0.1, max=120.0)] = None,
    estimator: Annotated[str, option("NAME", ESTIMATOR_HELP)] = "event_rate",
    to_bag: Annotated[Path | None, option("BAG", BAG_HELP)] = None,
    plot: Annotated[Path | None, option("FILE", "Draw the rates over time: .png, .svg or .pdf.")] = None,
    as_json: JsonOption = False,
    *,
    reading: BagReading,
) -> None:
    """Estimate turn rates from recorded events of stars, by the estimator that runs as a node.

    Recordings are cut into packets of 50 ms. Each window of the estimator gives a rate about the body's axes with its
    standard deviation, or the reason why it shows none. The exit code is 1 if no window has a rate.

    Try:

    fulmar rates night.aedat4 --fov 8.5 --plot rates.png

    fulmar rates left.h5 right.h5 --size 640x480 --json

    fulmar rates night.aedat4 --to-bag runs/night
    """
    from fulmar_cli.installation.extras import require
    from fulmar_core.robots.robot_file import load_robot
    from fulmar_evaluation.event_rates import cameras_of, packets_of, rates_of

    require(*_modules(sources, plot))
    if plot is not None:
        from fulmar_evaluation.report.writer import check_image

        check_image(plot)
    the_robot = load_robot(robot)
    cameras = cameras_of(the_robot, sources, size=_size(size), fov_deg=fov, reading=reading)
    with _kept(to_bag, the_robot, cameras, sources) as keep, work_bar("estimating") as moved:
        total = sum(path.stat().st_size for path in sources if path.is_file())
        done = [0]

        def each(packet: Packet) -> None:
            keep(packet)
            done[0] += len(packet[2])
            moved(done[0], max(total / BYTES_AN_EVENT, done[0]))

        found = rates_of(packets_of(sources, cameras, reading), cameras, estimator, each)
    if plot is not None:
        _draw(found, plot)
    print_result(found.document(), _print, as_json=as_json)
    if not len(found.times_s):
        raise typer.Exit(FAILED)


def _modules(sources: list[Path], plot: Path | None) -> list[str]:
    endings = {path.suffix for path in sources}
    needed = ["h5py", "hdf5plugin"] if endings & {".h5", ".hdf5"} else []
    needed += ["aedat"] if ".aedat4" in endings else []
    return [*needed, *(["matplotlib"] if plot else []), "mcap", "rosbags"]


def _size(text: str | None) -> tuple[int, int] | None:
    if text is None:
        return None
    numbers = text.lower().replace("×", "x").split("x")
    if len(numbers) != 2 or not all(number.isdigit() and int(number) for number in numbers):
        raise ConfigError(f"--size {text}: two numbers of pixels are needed, as in --size 640x480.")
    return int(numbers[0]), int(numbers[1])


@contextlib.contextmanager
def _kept(folder: Path | None, robot: Any, cameras: Any, sources: list[Path]) -> Iterator[Any]:
    """What writes packets into a bag; nothing without a folder."""
    if folder is None:
        yield lambda _packet: None
        return
    from fulmar_evaluation.event_bag import EventBag

    bag = EventBag(folder, robot, cameras, [path.name for path in sources])
    try:
        yield bag.add
    finally:
        bag.close()
    log_line(f"packets written to {folder}; feed a live estimator with: fulmar bag play {folder}")


def _draw(found: Rates, path: Path) -> None:
    from fulmar_evaluation.report.rate_plot import write_rate_plot

    try:
        write_rate_plot(found, path)
    except (OSError, ValueError) as error:
        raise ConfigError(f"--plot {path}: cannot be written: {error}") from error
    log_line(f"drawn: {path}")


def _print(document: dict[str, Any]) -> None:
    write_line(
        f"{document['events']} events in {document['seconds']:g} s; {document['windows']} windows with a rate"
    )
    if document["windows"]:
        mean, std = document["mean_deg_s"], document["std_deg_s"]
        pairs = zip("xyz", mean, std, strict=True)
        write_line(
            "  mean rate [°/s]  " + ", ".join(f"{a} {m:.4f} (each ± {1.96 * s:.4f})" for a, m, s in pairs)
        )
    for words, count in document["without_rate"].items():
        write_line(f"  {count} × {words}")
