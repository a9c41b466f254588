"""A class of the user's own is found by its dotted path, and every mistake gets one line with its place."""

from __future__ import annotations

import multiprocessing
import os
import subprocess
import sys

import pytest

from fulmar_core.config.errors import ConfigError, DeviceError
from fulmar_core.config.own_class import construct, load_class
from tests.own_files import own_folder

GOOD = "class Mine:\n    def act(self): return 'here'\n"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    with own_folder(tmp_path, monkeypatch):
        yield tmp_path


def load(text, members=("act",)):
    return load_class(text, members=members, what="controller")


def complaint(text, members=("act",)):
    with pytest.raises(ConfigError) as caught:
        load(text, members)
    message = str(caught.value)
    assert "\n" not in message
    return message


def test_a_class_of_the_current_folder_is_loaded(folder):
    (folder / "own_one.py").write_text(GOOD)
    assert load("own_one:Mine")().act() == "here"


def test_a_class_in_a_package_imports_its_neighbours(folder):
    (folder / "own_package").mkdir()
    (folder / "own_package" / "__init__.py").touch()
    (folder / "own_package" / "gains.py").write_text("WORD = 'near'\n")
    (folder / "own_package" / "law.py").write_text(
        "from own_package.gains import WORD\nclass Mine:\n    def act(self): return WORD\n"
    )
    assert load("own_package.law:Mine")().act() == "near"


def test_the_current_folder_comes_before_pythonpath(folder, tmp_path_factory, monkeypatch):
    other = tmp_path_factory.mktemp("other")
    for place, word in ((folder, "current"), (other, "pythonpath")):
        (place / "own_both.py").write_text(GOOD.replace("here", word))
    (other / "own_only_there.py").write_text(GOOD.replace("here", "pythonpath"))
    monkeypatch.syspath_prepend(str(other))
    assert load("own_both:Mine")().act() == "current"
    assert load("own_only_there:Mine")().act() == "pythonpath"


def in_another_process(text):
    return load(text)().act()


@pytest.mark.parametrize("method", ["spawn", "fork"])
def test_a_worker_of_a_pool_finds_it_too(folder, method):
    (folder / "own_worker.py").write_text(GOOD)
    with multiprocessing.get_context(method).Pool(1) as pool:
        assert pool.apply(in_another_process, ("own_worker:Mine",)) == "here"


@pytest.mark.parametrize("safe_path", ["", "1"])
def test_a_script_of_another_folder_finds_it_too(folder, tmp_path_factory, safe_path):
    """As `fulmar` and the scripts that ROS installs: the path of modules begins with the script's folder."""
    (folder / "own_script.py").write_text(GOOD)
    script = tmp_path_factory.mktemp("bin") / "node"
    script.write_text(
        "from fulmar_core.config.own_class import load_class\n"
        "print(load_class('own_script:Mine', members=('act',), what='x')().act())\n"
    )
    env = {**os.environ, "PYTHONSAFEPATH": safe_path}
    done = subprocess.run([sys.executable, script], cwd=folder, env=env, capture_output=True, text=True)
    assert done.stdout == "here\n", done.stderr


@pytest.mark.parametrize(
    "text",
    ["own", "own.Mine", "own:", ":Mine", "own:Mine:More", "own one:Mine", "../own:Mine", "own.:Mine", "1:M"],
)
def test_a_malformed_path_is_refused_with_the_right_form(folder, text):
    assert complaint(text) == f"'{text}' names no class: write it as mypackage.mymodule:MyClass."


@pytest.mark.parametrize(
    ("text", "right"), [("own.py:Mine", "own:Mine"), ("./mine/own.py:Mine", "mine.own:Mine"), ("../own.py:M", "own:M")]
)  # fmt: skip
def test_a_file_in_the_place_of_a_module_gets_the_advice_to_leave_its_ending_out(folder, text, right):
    assert complaint(text) == f"'{text}' names a file: write the module, and leave .py out: {right}."


def test_an_unknown_module_is_reported_with_the_nearest_of_the_folder(folder):
    (folder / "own_relay_board.py").write_text(GOOD)
    message = complaint("own_relay_bord:Mine")
    assert message.startswith(
        f"controller: there is no module 'own_relay_bord' in {folder}, on PYTHONPATH or"
    )
    assert message.endswith("Did you mean 'own_relay_board'?")


def test_an_unknown_module_of_a_package_is_reported_with_the_nearest_of_the_package(folder):
    (folder / "own_pack").mkdir()
    (folder / "own_pack" / "__init__.py").touch()
    (folder / "own_pack" / "boards.py").write_text(GOOD)
    message = complaint("own_pack.board:Mine")
    assert message == ("controller: there is no module 'board' in package 'own_pack'. Did you mean 'boards'?")
    assert "there is no module 'own_pak' in" in complaint("own_pak.boards:Mine")


@pytest.mark.parametrize(
    ("code", "says", "line"),
    [
        ("x = 1\ny = x / 0\n", "ZeroDivisionError: division by zero", 2),
        ("import no_such_thing\n", "ModuleNotFoundError: No module named 'no_such_thing'", 1),
        ("def f(:\n", "SyntaxError: invalid syntax", 1),
        ("import sys\n\nsys.exit('no\\nmore')\n", "SystemExit: no more", 3),
        ("import json\njson.loads('{')\n", "JSONDecodeError: Expecting property name", 2),
    ],
)
def test_a_module_that_raises_is_reported_with_the_user_s_line(folder, code, says, line):
    name = f"own_raises_{line}_{len(code)}"
    (folder / f"{name}.py").write_text(code)
    message = complaint(f"{name}:Mine")
    assert f"module '{name}' cannot be imported: {says}" in message
    assert f"({folder / name}.py:{line})" in message


def test_an_unknown_class_is_reported_with_the_nearest(folder):
    (folder / "own_name.py").write_text("class RelayBoard: pass\n")
    message = complaint("own_name:RelayBord")
    assert message == (
        f"controller 'own_name:RelayBord': {folder}/own_name.py has no class 'RelayBord'. Did you mean 'RelayBoard'?"
    )


def test_a_function_is_no_class(folder):
    (folder / "own_function.py").write_text("def make(): pass\n")
    assert complaint("own_function:make").endswith("'make' is a function, a class is needed.")


def test_missing_methods_are_named_and_a_typing_error_gets_the_nearest(folder):
    (folder / "own_lacks.py").write_text("class Mine:\n    def wrote(self): pass\n    def read(self): pass\n")
    message = complaint("own_lacks:Mine", ("read", "write", "close"))
    assert message.endswith("class 'Mine' lacks write, close. Did you mean 'wrote'?")
    assert complaint("own_lacks:Mine", ("x", "read")).endswith("lacks x. A controller needs: x, read.")


def test_an_abstract_method_that_was_only_inherited_counts_as_missing(folder):
    (folder / "own_abstract.py").write_text(
        "from abc import abstractmethod\n"
        "class Base:\n    @abstractmethod\n    def act(self): ...\n"
        "class Mine(Base): pass\n"
    )
    assert "class 'Mine' lacks act" in complaint("own_abstract:Mine")


def test_a_name_that_another_module_has_taken_is_refused_not_confused(folder):
    """`json` was loaded long ago: the user's own file of that name would never be read."""
    (folder / "json.py").write_text(GOOD)
    message = complaint("json:Mine")
    assert "'json' is a module that was loaded before, from " in message
    assert message.endswith(f"Rename {folder}/json.py.")


RAISING = (
    "from fulmar_core.config.errors import DeviceError\n"
    "class Mine:\n"
    "    def __init__(self, what):\n"
    "        if what == 'absent':\n"
    "            raise DeviceError('not there')\n"
    "        {}[what]\n"
    "    def act(self): pass\n"
)


def test_a_constructor_that_raises_is_reported_with_the_user_s_line(folder):
    (folder / "own_made.py").write_text(RAISING)
    cls = load("own_made:Mine")
    with pytest.raises(ConfigError) as caught:
        construct(cls, "Mine(what)", "controller", "key")
    assert str(caught.value) == (
        f"controller 'own_made:Mine': Mine(what) raised KeyError: 'key' ({folder}/own_made.py:6)."
    )
    with pytest.raises(ConfigError, match=r"Mine\(\) raised TypeError: .*missing 1 required positional"):
        construct(cls, "Mine()", "controller")


def test_an_error_that_a_constructor_means_stays_what_it_is(folder):
    (folder / "own_meant.py").write_text(RAISING)
    with pytest.raises(DeviceError, match=r"^not there$"):
        construct(load("own_meant:Mine"), "Mine(what)", "controller", "absent")
