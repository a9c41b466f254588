"""Runs a module of the user's own as a script; it is found as classes of the user's own are, see `own_class`.

python -m fulmar_core.config.own_module differences --ros-args ...
"""

from __future__ import annotations

import runpy
import sys

from fulmar_core.config.own_class import current_folder_first


def main() -> None:
    """Run the module that the first argument names, with the others."""
    name = sys.argv.pop(1)
    with current_folder_first(name.partition(".")[0]):
        runpy.run_module(name, run_name="__main__", alter_sys=True)


if __name__ == "__main__":
    main()
