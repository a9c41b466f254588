"""Where words go: results to standard output, everything else to standard error."""

from __future__ import annotations

import json
import sys
from typing import Any

from rich.console import Console

# Without emoji: `robot.yaml:100: ...` would come out with a picture in the place of its line.
console = Console(stderr=True, highlight=False, emoji=False)
output = Console(highlight=False, emoji=False)


def print_json(value: dict[str, Any]) -> None:
    """Print one JSON object and nothing else."""
    sys.stdout.write(json.dumps(value, indent=2, allow_nan=False) + "\n")
