"""The page docs/examples.md, made of the files in docs/examples.

`python -m tests.architecture.examples_page > docs/examples.md`
"""

from __future__ import annotations

import ast
import sys
from pathlib import Path

EXAMPLES = Path(__file__).resolve().parents[2] / "docs" / "examples"
TITLES = {  # in the order of the page
    "evaluate": "Compare two controllers",
    "simulate": "A loop of your own",
    "own_controller": "A controller of your own",
    "run_over_ros": "A run of the deployed nodes",
    "send_a_goal": "A client in ROS",
    "read_a_bag": "A bag as arrays",
    "gymnasium_episode": "An environment of Gymnasium",
    "train_and_export": "Learn and export",
}
INTRODUCTION = """\
# Examples in Python

<!-- Generated from docs/examples: python -m tests.architecture.examples_page > docs/examples.md -->

Each is a whole program with one idea, and a test runs it as it stands. The files lie in `docs/examples`; with
`.venv/bin` on the `PATH` they run in any folder.
"""


def page() -> str:
    """Its text."""
    return INTRODUCTION + "".join(_section(name, title) for name, title in TITLES.items())


def _section(name: str, title: str) -> str:
    """One example: what it does, then its code without the line that says so."""
    text = (EXAMPLES / f"{name}.py").read_text(encoding="utf-8")
    words = ast.get_docstring(ast.parse(text))
    code = text.partition("\n\n")[2]
    return f"\n## {title}\n\n{words} `{name}.py`:\n\n```python\n{code}```\n"


if __name__ == "__main__":
    sys.stdout.write(page())
