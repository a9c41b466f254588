"""The star catalogue is downloaded by its hash and unpacked where only the simulated cameras look."""

from __future__ import annotations

import sys
import zipfile
from pathlib import Path

import pytest

from fulmar_bringup import star_catalogue
from fulmar_core.config.errors import ConfigError, FulmarError
from fulmar_core.robots.sensors import catalogue


@pytest.fixture
def elsewhere(tmp_path, monkeypatch):
    """An environment without a catalogue."""
    monkeypatch.setattr(star_catalogue, "FOLDER", tmp_path / "stars")
    monkeypatch.setattr(star_catalogue, "catalogue_path", lambda: None)
    return tmp_path / "stars"


def test_what_is_there_already_is_not_fetched_again(fulmar):
    assert catalogue.catalogue_path() is not None, "run: make dev"
    assert star_catalogue.install_stars(lambda line: None) is False
    assert fulmar("install-stars")[:2] == (0, "the star catalogue is there already\n")


def test_the_wheel_is_unpacked_into_a_folder_of_its_own(elsewhere, monkeypatch):
    def download(command, step):
        if step == "download":
            assert "--require-hashes" in command
            folder = command[command.index("--dest") + 1]
            with zipfile.ZipFile(f"{folder}/one.whl", "w") as archive:
                archive.writestr(str(catalogue.FILE), b"stars")

    monkeypatch.setattr(star_catalogue, "_run", download)
    assert star_catalogue.install_stars(lambda line: None) is True
    assert (elsewhere / catalogue.FILE).read_bytes() == b"stars"


@pytest.fixture
def this_environment(monkeypatch):
    """Use this environment's pip; to make an environment takes seconds."""
    run = star_catalogue._run

    def linked(command, step):
        if command[1:3] == ["-m", "venv"]:
            python = Path(command[3]) / "bin" / "python"
            python.parent.mkdir(parents=True)
            python.write_text(f'#!/bin/sh\nexec "{sys.executable}" "$@"\n')
            python.chmod(0o755)
        else:
            run(command, step)

    monkeypatch.setattr(star_catalogue, "_run", linked)


def test_a_download_that_fails_says_what_was_printed(elsewhere, this_environment, monkeypatch, tmp_path):
    monkeypatch.setattr(star_catalogue, "LOCK", tmp_path / "missing.lock")
    with pytest.raises(FulmarError, match=r"star catalogue: could not download:\n.*missing\.lock"):
        star_catalogue.install_stars(lambda line: None)


def test_without_it_the_stars_are_one_line_with_the_command(monkeypatch):
    monkeypatch.setattr(catalogue, "catalogue_path", lambda: None)
    catalogue.load_stars.cache_clear()
    try:
        with pytest.raises(ConfigError, match=r"not installed\. Run: fulmar install-stars"):
            catalogue.load_stars()
    finally:
        catalogue.load_stars.cache_clear()
