"""Starts a node in the place of one that was lost, without taking the processor from a robot that moves.

    python -m fulmar_ros.yielding_start fulmar_ros.recorder_node --ros-args ...

The imports of a node take half a second of a core or more, which the controller may need. `run_node` takes the node's
place among the others back, once it spins.
"""

from __future__ import annotations

import importlib
import sys

from fulmar_core.config.yielding import in_yielding_thread, yield_session


def main() -> None:
    """Import a node's module and run its `main`."""
    name = sys.argv.pop(1)
    yield_session()
    module = in_yielding_thread(lambda: importlib.import_module(name))
    sys.argv[0] = str(module.__file__)
    module.main()


if __name__ == "__main__":
    main()
