"""Files of the current folder, and packages of another Python, take the place of no module."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from fulmar_core.config.module_path import (
    is_of_another_python,
    own_packages,
    safe_environment,
    search_strangers_last,
)

SHADOWS = ("random", "yaml", "signal", "numpy", "struct")
OWN = """
import random, sys
from neighbour import WORD
print(WORD, random.random() < 2.0, sys.argv[1:], __name__)
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The current folder, with modules whose names others have."""
    monkeypatch.chdir(tmp_path)
    for name in SHADOWS:
        (tmp_path / f"{name}.py").write_text("raise SystemExit('the file of the user was run')\n")
    return tmp_path


def run(*words, **variables):
    """Run this Python as a launcher starts it; a variable that is None is not set."""
    environment = {**os.environ, **safe_environment({**os.environ, **variables})}
    done = subprocess.run([sys.executable, *words], env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_current_folder_and_other_pythons_are_searched_last_and_the_rest_keeps_its_order(
    folder, monkeypatch
):
    other = "/opt/ros/jazzy/lib/python3.99/site-packages"
    monkeypatch.setattr(sys, "path", ["", other, "/b", str(folder), "/a"])
    search_strangers_last()
    assert sys.path == ["/b", "/a", other, "", str(folder)]


def test_a_folder_of_packages_says_by_its_name_whose_it_is():
    own = "python{}.{}".format(*sys.version_info)
    assert is_of_another_python("/opt/ros/jazzy/lib/python3.99/site-packages")
    assert not is_of_another_python(f"/opt/python3.99/lib/{own}/site-packages")
    assert not is_of_another_python("/home/me/ws/src")


@pytest.mark.parametrize("path", ["", ":", ":{}", "{}:"])
def test_an_empty_part_of_pythonpath_does_not_bring_the_current_folder_back(folder, path):
    given = path.format(os.environ.get("PYTHONPATH", "/nowhere"))
    assert run("-c", "import random, yaml, numpy; print(random.__name__)", PYTHONPATH=given) == "random\n"


def test_a_module_of_the_user_s_own_is_found_with_its_neighbours_and_without_the_others(folder):
    (folder / "own_node.py").write_text(OWN)
    (folder / "neighbour.py").write_text("WORD = 'near'\n")
    said = run("-m", "fulmar_core.config.own_module", "own_node", "--ros-args", "-r")
    assert said == "near True ['--ros-args', '-r'] __main__\n"


def test_a_class_of_the_user_s_own_is_found_before_installed_ones_and_imports_what_all_import(folder):
    (folder / "own_law.py").write_text(
        "import random\nclass Mine:\n    def act(self): return random.__file__\n"
    )
    (folder / "mcap").mkdir()
    (folder / "mcap" / "__init__.py").write_text("class Mine:\n    def act(self): return __file__\n")
    asks = (
        "from fulmar_core.config.own_class import load_class\n"
        "for name in ('own_law:Mine', 'mcap:Mine'):\n"
        "    print(load_class(name, members=('act',), what='x')().act())\n"
    )
    random, mcap = run("-c", asks).split()
    assert not random.startswith(str(folder))
    assert mcap == str(folder / "mcap" / "__init__.py")


def test_a_class_in_a_file_that_is_called_like_a_module_of_python_is_refused_also_if_none_was_loaded(folder):
    (folder / "wave.py").write_text("class Mine: pass\n")
    asks = (
        "from fulmar_core.config.own_class import load_class\n"
        "from fulmar_core.config.errors import ConfigError\n"
        "try: load_class('wave:Mine', members=(), what='driver')\n"
        "except ConfigError as error: print(error)\n"
    )
    assert run("-c", asks).endswith(f"Rename {folder}/wave.py.\n")


def test_children_get_no_folder_of_another_python():
    theirs, ours = "/opt/ros/lib/python3.99/site-packages", "/home/me/modules"
    assert own_packages({"PYTHONPATH": os.pathsep.join([theirs, ours])}) == {"PYTHONPATH": ours}
    assert own_packages({"HOME": "/home/me"}) == {}
