"""README and docs: commands, options, links, files and examples exist and work."""

from __future__ import annotations

import configparser
import dataclasses
import itertools
import json
import re
import shlex
from pathlib import Path

import pytest
import typer.main
from typer.testing import CliRunner

from fulmar_cli.main import app

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
PAGES = {path.stem: path for path in (ROOT / "README.md", *sorted(DOCS.glob("*.md")))}
COMMAND = re.compile(r"^ *(fulmar [a-z].*)$", re.MULTILINE)
INLINE = re.compile(r"`fulmar ([a-z]+(?:-[a-z0-9]+)*)")
FILE = re.compile(
    r"`((?:fulmar_|sim_nodes|policy_server|hardware_drivers|training|configs|tests)[\w/]*/[\w./]+)`"
)
PASTED = re.compile(r"^cat > (mine/\S+) <<'EOF'\n(.*?)^EOF$", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\(([^)#:]+)\)")


@pytest.fixture(params=PAGES)
def name(request) -> str:
    return request.param


@pytest.fixture
def page(name) -> str:
    return text_of(name)


def text_of(name: str) -> str:
    return PAGES[name].read_text(encoding="utf-8")


def shown(page: str) -> str:
    """Code of a page: fenced or indented."""
    fenced = re.findall(r"^```\w*\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
    return "\n".join((*fenced, *re.findall(r"^    .*$", page, re.MULTILINE)))


@pytest.fixture(scope="module")
def root():
    return typer.main.get_command(app)


def test_every_command_exists_with_its_options(page, root):
    for line in COMMAND.findall(shown(page)):
        words = re.split(r"\s{2,}(?=[^-])|\s#\s|\s&&\s", line)[0]  # the words beside a command explain it
        words = shlex.split(words.replace("[", "").replace("]", ""))[1:]
        command = root
        while words and hasattr(command, "commands"):
            assert words[0] in command.commands, line
            command = command.commands[words.pop(0)]
        known = {"--help"}.union(*(each.opts + each.secondary_opts for each in command.params))
        assert {word.split("=")[0] for word in words if word.startswith("--")} <= known, line


def test_every_command_in_the_text_exists(page, root):
    assert set(INLINE.findall(page)) <= set(root.commands)


def test_every_linked_file_exists_and_is_small(name, page):
    for link in LINK.findall(page):
        assert (PAGES[name].parent / link).stat().st_size < 500_000, link


def test_every_named_file_exists(page):
    for name in FILE.findall(page):
        package = name.split("/")[0]
        places = (ROOT, ROOT / "ros2_ws" / "src" / package)
        assert any((place / name).exists() for place in places), name


def test_every_page_is_linked():
    linked = {path.parent / link for path in PAGES.values() for link in LINK.findall(path.read_text("utf-8"))}
    assert set(DOCS.glob("*.md")) <= linked


def test_every_make_target_of_the_first_hour_exists(repository):
    makefile = (repository / "Makefile").read_text(encoding="utf-8")
    for target in re.findall(r"^make ([a-z-]+)", text_of("first_hour"), re.MULTILINE):
        assert re.search(rf"^{target}:", makefile, re.MULTILINE), target


@pytest.fixture
def first_hour(tmp_path, monkeypatch, repository):
    """Folder with the files of the first hour, as FULMAR_CONFIGS."""
    page = text_of("first_hour")
    files = dict(PASTED.findall(page))
    for source, target in re.findall(r"^cp (\S+) (mine/\S+)$", page, re.MULTILINE):
        files[target] = (repository / source).read_text(encoding="utf-8")
    for name, content in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(content, encoding="utf-8")
    monkeypatch.setenv("FULMAR_CONFIGS", str(tmp_path / "mine"))
    return files


def test_the_robot_of_the_first_hour_reaches_its_goals_by_the_lqr(first_hour):
    line = next(line for line in COMMAND.findall(text_of("first_hour")) if "evaluate hexbot" in line)
    words = [*shlex.split(line)[1:], "--episodes", "8", "--json"]
    result = CliRunner().invoke(app, words)
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout)["success_rate"] == 1.0


def test_the_driver_of_the_first_hour_has_a_line_for_every_nozzle(first_hour):
    from fulmar_core.robots.robot_file import load_robot
    from hardware_drivers.hardware import load_hardware

    hardware = load_hardware("hexbot_gpio")
    assert hardware.robot == "hexbot"
    assert len(hardware.driver.lines) == len(load_robot("hexbot").actuators.names)


@pytest.mark.slow
def test_the_gymnasium_example_runs_and_is_short():
    pytest.importorskip("stable_baselines3")
    import numpy as np
    import torch

    threads = torch.get_num_threads()
    torch.set_num_threads(1)  # networks this small are slower on two
    example, *_ = re.findall(r"^```python\n(.*?)^```", text_of("training"), re.MULTILINE | re.DOTALL)
    assert len([line for line in example.splitlines() if line]) <= 15
    names: dict[str, object] = {}
    try:
        exec(compile(example, "docs/training.md", "exec"), names)
    finally:
        torch.set_num_threads(threads)
    assert names["done"]
    assert np.shape(names["observations"]) == (1024, len(np.asarray(names["observation"])))


def test_the_systemd_unit_has_an_existing_program_and_parameters():
    from hardware_drivers.driver_node import DriverSettings

    page = text_of("hardware")
    unit = configparser.ConfigParser(interpolation=None, strict=True)
    unit.optionxform = str  # type: ignore[assignment, method-assign]
    unit.read_string(page[page.index("[Unit]") : page.index("```", page.index("[Unit]"))])
    assert unit["Service"]["Restart"] == "always"
    words = shlex.split(unit["Service"]["ExecStart"])
    assert words[1:3] == ["-m", DriverSettings.__module__]
    given = dict(word.split(":=") for before, word in itertools.pairwise(words) if before == "-p")
    assert set(given) <= {field.name for field in dataclasses.fields(DriverSettings)}
    assert {"robot", "hardware", "estop"} <= set(given)
