"""`fulmar new`: make the file of a robot from less than all that it needs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fulmar_bringup.console import print_json, write_line
from fulmar_cli.commands.arguments import JsonOption, argument, flag, option
from fulmar_core.config.errors import ConfigError

new = typer.Typer(help="Make a robot's file from a few numbers.", no_args_is_help=True, rich_markup_mode=None)


@new.callback()
def _group() -> None:
    """Makes a group of the only command."""


@new.command()
def airframe(
    geometry: Annotated[
        Path, argument("GEOMETRY", "A .yaml file of wing, tail and fin; see docs/flight.md.")
    ],
    out: Annotated[Path, option("FILE", "The robot's file to write (.yaml).")],
    python: Annotated[
        Path, option("PATH", "A Python that has openaerostruct; `make peers` makes this one.")
    ] = Path(".venv-peers/bin/python"),
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
    from fulmar_core.config.strict_yaml import load_config
    from fulmar_evaluation.new_airframe.coefficient_set import coefficient_set
    from fulmar_evaluation.new_airframe.geometry import Geometry
    from fulmar_evaluation.new_airframe.robot_file import write_robot

    if out.suffix not in (".yaml", ".yml"):
        raise ConfigError(f"--out {out}: a robot's file ends in .yaml.")
    if out.exists() and not force:
        raise ConfigError(f"{out} exists already; no file is overwritten. Give --out another, or --force.")
    shape = load_config(Geometry, geometry)
    terms = coefficient_set(shape, python)
    source = f"Coefficients by OpenAeroStruct's vortex lattice from {geometry.name}."
    write_robot(shape, terms, out, source, geometry=geometry)
    if as_json:
        print_json({"robot": shape.name, "file": str(out), "terms": terms})
        return
    write_line(f"{shape.name}: {shape.title}")
    for name, each in terms.items():
        write_line(f"  {name}  " + "  ".join(f"{factor} {value:.4g}" for factor, value in each.items()))
    write_line(f"wrote {out}; check it: fulmar check robot {out}")
