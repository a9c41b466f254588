"""Pages of the documentation that are made of the code are up to date, and every page is on the site."""

from __future__ import annotations

import re
import subprocess
import tomllib

import pytest

from tests.architecture import commands_page, examples_page, keys_page, safety_case_page

PAGES = {
    commands_page: "all_commands.md",
    examples_page: "examples.md",
    keys_page: "keys.md",
    safety_case_page: "safety_case.md",
}


@pytest.mark.parametrize("module", PAGES, ids=lambda module: module.__name__.rpartition(".")[2])
def test_a_generated_page_is_up_to_date(repository, module):
    page = f"docs/{PAGES[module]}"
    written = (repository / page).read_text(encoding="utf-8")
    make = f"python -m {module.__name__} > {page}"
    assert written == module.page(), f"Make it again: {make}"


def test_the_page_of_commands_has_every_command_with_its_help():
    page = commands_page.page()
    for words in ("fulmar run", "fulmar bag export", "fulmar benchmark all", "fulmar service install"):
        help_text = page.split(f"# {words}\n")[1].split("```")[1]
        assert help_text.startswith(f"text\nUsage: {words} "), words
        assert "--help" in help_text, words


def test_the_page_of_examples_has_every_file(repository):
    files = {path.stem for path in (repository / "docs/examples").glob("*.py")}
    assert files == set(examples_page.TITLES)


def test_every_page_of_the_documentation_is_in_the_navigation(repository):
    nav = tomllib.loads((repository / "zensical.toml").read_text(encoding="utf-8"))["project"]["nav"]
    listed = [page for section in nav for pages in section.values() for page in pages]
    there = sorted(path.name for path in (repository / "docs").glob("*.md"))
    assert sorted(listed) == there


@pytest.mark.slow
def test_the_site_is_built_without_a_warning_and_asks_nothing_from_outside(repository):
    done = subprocess.run(
        ["make", "site"], cwd=repository, capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "warning" not in (done.stdout + done.stderr).lower()
    page = (repository / "site" / "index.html").read_text(encoding="utf-8")
    loaded = re.findall(r"<(?:script|link|img)[^>]*(?:src|href)=[\"']?(https?://[^\"' >]+)", page)
    assert not [address for address in loaded if "example.org" not in address], loaded
