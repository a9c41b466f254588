"""Command files stay short, and the command line loads nothing heavy before a command needs it."""

from __future__ import annotations

import ast
import subprocess
import sys

LINES, BODY = 150, 40  # of a file of a command; of a function, beside its options and docstring
HEAVY = ("torch", "mujoco", "rclpy", "onnxruntime", "matplotlib", "numpy")


def bodies(text: str) -> dict[str, int]:
    """Lines of the body of each function of a module, from the first statement after its docstring on."""
    found = {}
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef):
            statements = node.body[1:] if ast.get_docstring(node) is not None else node.body
            found[node.name] = statements[-1].end_lineno - statements[0].lineno + 1 if statements else 0
    return found


def test_the_measure_of_a_body_leaves_options_and_docstring_out():
    text = 'def f(\n    a,\n    b,\n):\n    """First.\n\n    Second.\n    """\n    c = a\n    return c\n'
    assert bodies(text) == {"f": 2}


def test_a_command_parses_calls_and_prints_and_is_short(repository):
    files = list((repository / "ros2_ws/src/fulmar_cli/fulmar_cli/commands").glob("*.py"))
    assert len(files) > 20
    texts = {file.name: file.read_text(encoding="utf-8") for file in files}
    assert {name: n for name, text in texts.items() if (n := len(text.splitlines())) > LINES} == {}
    long = {(name, f): n for name, text in texts.items() for f, n in bodies(text).items() if n > BODY}
    assert long == {}


def test_the_command_line_is_imported_without_heavy_libraries():
    program = (
        "import sys, fulmar_cli, fulmar_cli.main\n"
        f"print(sorted(name for name in {HEAVY} if name in sys.modules))"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=60
    )
    assert done.stdout.strip() == "[]"
