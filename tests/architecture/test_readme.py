"""README: short, with every robot and task, make targets and folders that exist, and small images.

test_docs.py checks its commands and links.
"""

from __future__ import annotations

import re

import pytest

from fulmar_core.config.paths import config_names

LARGEST = 150_000  # of an image [bytes]
IMAGES = "docs/pictures/"


@pytest.fixture
def readme(repository) -> str:
    return (repository / "README.md").read_text(encoding="utf-8")


def test_length_is_under_120_lines(readme):
    assert len(readme.splitlines()) < 120


def test_make_targets_exist(readme, repository):
    makefile = (repository / "Makefile").read_text(encoding="utf-8")
    assert set(re.findall(r"make ([a-z-]+)", readme)) <= set(
        re.findall(r"^([a-z-]+):", makefile, re.MULTILINE)
    )


def test_folders_exist(readme, repository):
    folders = re.findall(r"^\| `([a-z_0-9/]+/)` \|", readme, re.MULTILINE)
    assert len(folders) >= 8
    assert all((repository / folder).is_dir() for folder in folders)


def named(readme: str, head: str) -> set[str]:
    """Names in the first table whose head begins so, in code."""
    table = readme.split(head)[1].split("\n\n")[0]
    return set(re.findall(r"`([a-z0-9_]+)`", table))


def test_the_table_of_robots_has_every_robot_and_no_other(readme):
    assert named(readme, "| Robot |") == set(config_names("robots"))


def test_the_table_of_tasks_has_every_task_and_no_other(readme):
    assert named(readme, "| Tasks |") == set(config_names("tasks"))


def images_of(readme: str) -> list[str]:
    """Names of its images, without folder and ending."""
    return re.findall(rf"\]\({IMAGES}([a-z]+)\.png\)", readme)


def test_images_are_small(readme, repository):
    names = images_of(readme)
    assert len(names) == 3
    for name in (*names, "satellite"):
        assert (repository / IMAGES / f"{name}.png").stat().st_size < LARGEST, name


def test_each_image_has_the_command_that_makes_it(readme):
    for name in images_of(readme):
        assert f"--record runs/{name}\n" in readme


def test_the_film_on_top_is_small_and_has_its_one_command(readme, repository):
    assert readme.index(f"{IMAGES}robots.webp") < readme.index(IMAGES + "platform.png")
    assert (repository / IMAGES / "robots.webp").stat().st_size < 1_500_000
    bags = re.findall(r"^fulmar report (.*) --video robots\.webp", readme, re.MULTILINE)[0].split()
    assert all(f"--record {bag}\n" in readme for bag in bags)
