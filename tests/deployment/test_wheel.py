"""The wheel: it has what the commands read, and nothing else."""

from __future__ import annotations

import email
import re
import subprocess
import tomllib
import zipfile
import zlib
from pathlib import Path

import pytest
from hatchling.builders.wheel import WheelBuilder

from fulmar_ros.middleware import OWN_PROFILES

SOURCES = "ros2_ws/src/"
IN_SOURCES = ("core", "bags", "ros", "bringup", "evaluation", "benchmarks", "cli", "console")
# Folders of the repository, and where the wheel has what is in them.
PLACES = {
    "configs/": "fulmar_core/configs/",
    "ros2_ws/src/fulmar_bringup/launch/": "fulmar_bringup/launch/",
    **{f"{SOURCES}fulmar_{name}/fulmar_{name}/": f"fulmar_{name}/" for name in IN_SOURCES},
    **{f"{name}/": f"{name}/" for name in ("sim_nodes", "policy_server", "hardware_drivers", "training")},
}


class Listed:
    """What the builder would put into the wheel from this checkout, in a fraction of the time of building it."""

    def __init__(self, repository):
        self._builder = WheelBuilder(str(repository))
        self._files = list(self._builder.recurse_included_files())
        self.name = f"{self._builder.artifact_project_id}-{self._builder.get_default_tag()}.whl"

    def content(self):
        return {file.distribution_path for file in self._files}

    def description(self):
        constructor = self._builder.config.core_metadata_constructor
        return email.message_from_string(constructor(self._builder.metadata))

    def size(self):
        return sum(len(zlib.compress(Path(file.path).read_bytes())) for file in self._files)


class Built:
    """The wheel itself, built from the archive of the sources."""

    def __init__(self, path):
        self._path, self.name = path, path.name

    def content(self):
        with zipfile.ZipFile(self._path) as archive:
            return {name for name in archive.namelist() if ".dist-info/" not in name}

    def description(self):
        with zipfile.ZipFile(self._path) as archive:
            (name,) = (name for name in archive.namelist() if name.endswith(".dist-info/METADATA"))
            return email.message_from_bytes(archive.read(name))

    def size(self):
        return self._path.stat().st_size


@pytest.fixture(scope="module", params=["listed", pytest.param("built", marks=pytest.mark.slow)])
def made(request, repository):
    return Listed(repository) if request.param == "listed" else Built(request.getfixturevalue("wheel"))


@pytest.fixture(scope="module")
def content(made):
    """Names of the wheel's files, without its own description."""
    return made.content()


@pytest.fixture(scope="module")
def description(made):
    return made.description()


def kept(repository):
    """Files of the repository that git keeps, or would keep."""
    words = ["git", "ls-files", "--cached", "--others", "--exclude-standard"]
    return subprocess.run(words, cwd=repository, capture_output=True, text=True, check=True).stdout.split(
        "\n"
    )


def test_it_has_every_file_of_every_package_and_nothing_else(repository, content):
    wanted = {
        target + path.removeprefix(source)
        for path in kept(repository)
        for source, target in PLACES.items()
        if path.startswith(source) and (repository / path).is_file()
    }
    named = {"sim_nodes/sim_node.py", "fulmar_core/configs/policies.yaml"}
    assert named | {f"fulmar_ros/{Path(profile).name}" for profile in OWN_PROFILES} <= wanted
    assert content == wanted


def test_it_is_small(made):
    assert made.size() < 5_000_000


def test_its_metadata_is_that_of_the_project(repository, description):
    project = tomllib.loads((repository / "pyproject.toml").read_text())["project"]
    assert description["Version"] == project["version"]
    assert set(description["Requires-Python"].split(",")) == set(project["requires-python"].split(","))
    assert set(description.get_all("Provides-Extra")) == set(project["optional-dependencies"])


def test_its_description_has_no_relative_link(description):
    text = description.get_payload()
    assert "pip install" in text
    assert re.findall(r"\]\((?!https:)", text) == []


def test_the_pages_name_the_file_that_is_built(repository, made):
    page = (repository / "docs" / "installation.md").read_text()
    assert set(re.findall(r"fulmar-[\w.-]+\.whl", page)) == {made.name}
