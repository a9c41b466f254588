"""`fulmar benchmark` in a checkout, and where Fulmar is installed without one."""

from __future__ import annotations

import importlib.util
import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from fulmar_cli.commands import benchmark as commands
from fulmar_core.errors import ConfigError

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
