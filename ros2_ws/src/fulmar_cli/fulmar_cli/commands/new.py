"""`fulmar new`: make the file of a robot from less than all that it needs, and classes of one's own."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from fulmar_bringup.console import print_json, write_line
from fulmar_cli.commands.arguments import JsonOption, argument, flag, option
from fulmar_cli.commands.new_part import add_parts
from fulmar_core.config.errors import ConfigError

new = typer.Typer(
    help="Make a robot's file, or a class of your own.", no_args_is_help=True, rich_markup_mode=None
)


@new.callback()
def _group() -> None:
    """Makes a group."""


@new.command()
def airframe(
    geometry: Annotated[
        Path, argument("GEOMETRY", "A .yaml file of wing, tail and fin; see docs/flight.md.")
    ],
    out: Annotated[Path, option("FILE", "The robot's file to write (.yaml).")],
    python: Annotated[
        Path | None,
        option("PATH", "A Python that has openaerostruct; that of `make peers` by default."),
    ] = None,
    force: Annotated[bool, flag("--force", "Replace FILE.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Compute an aircraft's coefficients from its geometry, by the vortex lattice of OpenAeroStruct.

    A lattice knows neither friction nor the fuselage nor stall: the geometry's `profile_drag` is added to the drag, and
    `stall_deg` is taken as it is. What the geometry does not say is that of the aircraft it is `like`, with outline,
    motors, performance and limits scaled to its size, weight and speed.

    Try:

    fulmar new airframe my_geometry.yaml --out my_craft.yaml

    fulmar check robot my_craft.yaml
    """
    from fulmar_core.config.other_environment import peers_python
    from fulmar_core.config.strict_yaml import load_config
    from fulmar_evaluation.new_airframe.coefficient_set import coefficient_set
    from fulmar_evaluation.new_airframe.geometry import Geometry
    from fulmar_evaluation.new_airframe.robot_file import write_robot

    if out.suffix not in (".yaml", ".yml"):
        raise ConfigError(f"--out {out}: a robot's file ends in .yaml.")
    if out.exists() and not force:
        raise ConfigError(f"{out} exists already; no file is overwritten. Give --out another, or --force.")
    shape = load_config(Geometry, geometry)
    terms = coefficient_set(shape, python or peers_python("The vortex lattice is OpenAeroStruct's"))
    source = f"Coefficients by OpenAeroStruct's vortex lattice from {geometry.name}."
    write_robot(shape, terms, out, source, geometry=geometry)
    if as_json:
        print_json({"robot": shape.name, "file": str(out), "terms": terms})
        return
    write_line(f"{shape.name}: {shape.title}")
    for name, each in terms.items():
        write_line(f"  {name}  " + "  ".join(f"{factor} {value:.4g}" for factor, value in each.items()))
    write_line(f"wrote {out}; check it: fulmar check robot {out}")


@new.command()
def robot(
    name: Annotated[str, argument("NAME", "Of the new robot, and of its file.")],
    like: Annotated[
        str, option("ROBOT", "The most similar one of `fulmar list robots`: what nothing else says is its.")
    ],
    urdf: Annotated[Path | None, option("FILE", "Take what a URDF says; a xacro has to be expanded.")] = None,
    mjcf: Annotated[Path | None, option("FILE", "Take what a MuJoCo model (.xml) says.")] = None,
    root: Annotated[
        str, option("LINK", "Whose frame is the robot's; base_link or the outermost by default.")
    ] = "",
    actuators: Annotated[
        str, option("NAMES", "Links, sites or joints that move it, with commas; patterns such as jet_*.")
    ] = "",
    settings: Annotated[
        list[str] | None, option("KEY=VALUE", "A value of the file, such as body.mass=8.1.", "--set")
    ] = None,
    out: Annotated[
        Path | None, option("DIR", "Folder to write robots/NAME.yaml into; FULMAR_CONFIGS, or mine.")
    ] = None,
    force: Annotated[bool, flag("--force", "Replace the file.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Write a commented robot file, and say what to measure with which command.

    Mass, inertia, centre of mass, outline, camera, wheels, thrusters and propellers of a URDF or a MuJoCo model are
    taken; what was not is listed with what to write. Spans, performance and limits follow from body and actuators.

    Try:

    fulmar new robot mybot --like floating_platform --set body.mass=8.1

    fulmar new robot husky --like turtlebot2 --urdf husky.urdf
    """
    from fulmar_evaluation.new_robot.new_robot import make_robot
    from fulmar_evaluation.new_robot.settings import read_settings
    from fulmar_evaluation.new_robot.sources import read_description
    from fulmar_evaluation.new_robot.written import check_new_name, usual_folder, write_robot

    folder = out or usual_folder()
    path = check_new_name(name, folder, replaces=force)
    names = _split(actuators)
    description = read_description(urdf, mjcf, root)
    values = read_settings(settings or [])
    found = make_robot(name, like, values, description, names)
    if found.unnamed and not as_json and sys.stdin.isatty():
        asked = typer.prompt(
            f"{found.unnamed} (NAME,NAME; nothing: as {like})", default="", show_default=False
        )
        if names := _split(asked):
            found = make_robot(name, like, values, description, names)
    write_robot(found, path)
    if as_json:
        gaps = [vars(gap) for gap in found.gaps]
        print_json({"robot": name, "file": str(path), "not_taken": gaps, "steps": list(found.steps)})
        return
    write_line(f"wrote {path}; it loads. Let Fulmar find it: export FULMAR_CONFIGS={folder.absolute()}")
    for gap in found.gaps:
        write_line(f"  not taken: {gap}")
    write_line("measure, in this order:")
    for step in found.steps:
        write_line(f"  {step}")


def _split(names: str) -> list[str]:
    """Names with commas between them."""
    return [each.strip() for each in names.split(",") if each.strip()]


add_parts(new)
