"""What `fulmar run --system FLEET` does, in a process of its own, with what a fault needs at one of the robots.

It prints one event at its end: why the run failed, and how each robot did.
"""

from __future__ import annotations

import json
import os
import signal
import sys
from pathlib import Path
from types import FrameType
from typing import Any

from fulmar_core.config.errors import FAILED, FulmarError
from fulmar_core.config.process import end_with
from fulmar_evaluation.faults.fleet_environment import harmed_fleet
from fulmar_evaluation.faults.fleet_suite import fleet_fault
from fulmar_evaluation.faults.launched import ENDS
from fulmar_evaluation.fleet_outcome import run_fleet_and_evaluate


def main() -> None:
    """Run a fleet until its end, or until SIGINT or SIGTERM; arguments as in `fleet_system.command_of`."""
    name, robot, fault, record, seed = sys.argv[1:]
    signal.signal(signal.SIGTERM, _on_terminate)
    end_with(os.getppid(), signal.SIGTERM)
    failure, robots = "", dict[str, Any]()
    try:
        about = fleet_fault(fault).about
        outcome = run_fleet_and_evaluate(harmed_fleet(name, robot, Path(record), about, seed=int(seed)))
        failure = outcome.failure
        robots = {
            one: {word: found[word] for word in ("success", "failure", "watchdog_trips")}
            for one, found in outcome.summary["robots"].items()
        }
    except FulmarError as error:
        failure = str(error)
    except KeyboardInterrupt as stop:
        failure = str(stop)
    sys.stdout.write(json.dumps({"event": ENDS, "failure": failure or None, "robots": robots}) + "\n")
    sys.stdout.flush()
    sys.exit(FAILED if failure else 0)


def _on_terminate(number: int, _frame: FrameType | None) -> None:
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    raise KeyboardInterrupt(f"stopped by {signal.Signals(number).name}")


if __name__ == "__main__":
    main()
