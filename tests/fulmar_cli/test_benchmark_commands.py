"""`fulmar benchmark` in a checkout, and where Fulmar is installed without one."""

from __future__ import annotations

import importlib.util
import shutil
from pathlib import Path
from typing import Annotated

import pytest
import typer
from typer.testing import CliRunner

from fulmar_bringup.console import write_line
from fulmar_cli.commands import benchmark as commands
from fulmar_cli.commands.arguments import renamed
from fulmar_core.config.errors import ConfigError

MACHINERY = sorted(commands.OF_A_CHECKOUT)


def installed(folder: Path):
    """The group of commands as a module below another root, without tests beside it."""
    place = folder.joinpath(*"abcde", "benchmark.py")
    place.parent.mkdir(parents=True)
    shutil.copy(commands.__file__, place)
    spec = importlib.util.spec_from_file_location("benchmark_installed", place)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.benchmark


@pytest.mark.parametrize("name", MACHINERY)
def test_a_checkout_has_the_benchmarks_of_our_own_machinery(name):
    shown = CliRunner().invoke(commands.benchmark, [name, "--help"])
    assert shown.exit_code == 0
    assert "Only from a checkout" not in shown.output


@pytest.mark.parametrize("name", MACHINERY)
def test_elsewhere_each_says_that_it_needs_a_checkout(name, tmp_path):
    done = CliRunner().invoke(installed(tmp_path), [name, "--episodes", "3"])
    assert isinstance(done.exception, ConfigError)
    assert f"`fulmar benchmark {name}`" in str(done.exception)
    assert "Run it from a checkout, after `make dev`." in str(done.exception)


def test_the_old_name_of_an_option_works_is_hidden_and_warns():
    app = typer.Typer()

    @app.command()
    def draw(plot: str = "", old_plot: Annotated[str | None, renamed("--picture", "--plot")] = None) -> None:
        write_line(plot or old_plot)

    run = CliRunner().invoke
    assert "--picture" not in run(app, ["--help"]).output
    done = run(app, ["--picture", "a.png"])
    assert done.stdout == "a.png\n"
    assert (
        done.stderr
        == "warning: --picture is now called --plot; the old name will be removed in the next release\n"
    )
    assert run(app, ["--plot", "a.png"]).stderr == ""
