"""`fulmar install-stars`: the star catalogue for simulated event cameras."""

from __future__ import annotations

from fulmar_bringup.console import log_line, print_json, write_line
from fulmar_cli.commands.arguments import JsonOption


def install_stars(as_json: JsonOption = False) -> None:
    """Download the Hipparcos catalogue, which simulated event cameras look at.

    It comes out of the package cedar-solve (Apache-2.0, 8 MB) and is unpacked below share/fulmar of this environment.
    `fulmar benchmark events` and runs with event cameras need it, hardware does not.

    Try:

    fulmar install-stars

    fulmar run cubesat_wheels --task point --scenario gyro_dies --lockstep --seed 3
    """
    from fulmar_bringup.star_catalogue import install_stars as install

    fetched = install(log_line)
    if as_json:
        print_json({"catalogue": "hipparcos", "fetched": fetched})
    else:
        write_line("the star catalogue is installed" if fetched else "the star catalogue is there already")
