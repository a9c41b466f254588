"""A user's own class that imports a module by its former name still works, and its line is named."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from fulmar_core.config.moved_modules import MOVED

OWN = """
from fulmar_core.health.filters import HealthSettings
from fulmar_core.robot import Robot, load_robot
from fulmar_core.robots.robot import Robot as Now
assert isinstance(load_robot("turtlebot2"), Robot) and Robot is Now
"""


def test_former_names_give_the_same_classes_and_warn_with_the_line_that_imports_them(tmp_path: Path) -> None:
    own = tmp_path / "own.py"
    own.write_text(OWN)
    done = subprocess.run([sys.executable, own], capture_output=True, text=True, check=True, timeout=60)
    assert (
        f"{own}:2: FutureWarning: 'fulmar_core.health.filters' is now fulmar_core.estimators" in done.stderr
    )
    assert f"{own}:3: FutureWarning: 'fulmar_core.robot' is now fulmar_core.robots.robot and" in done.stderr


@pytest.mark.parametrize("name", MOVED)
def test_every_former_name_leads_to_modules_that_are_there(name: str) -> None:
    with pytest.warns(FutureWarning, match="goes with the next release"):
        __import__(name)
    del sys.modules[name]
