"""`fulmar --install-completion` makes bash complete commands and options."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

BASH = shutil.which("bash")  # make needs it, too
FULMAR = Path(sys.executable).with_name("fulmar")
ASK = """
source ~/.bashrc
COMP_WORDS=({words}) COMP_CWORD={last}
_fulmar_completion fulmar
printf '%s\\n' "${{COMPREPLY[@]}}"
"""


@pytest.fixture(scope="module")
def home(tmp_path_factory):
    """A home folder in which completion was installed."""
    folder = tmp_path_factory.mktemp("home")
    subprocess.run([FULMAR, "--install-completion", "bash"], env=_environment(folder), check=True)
    return folder


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("fulmar doc", ["doctor"]),
        ("fulmar bag rer", ["rerun"]),
        ("fulmar doctor --f", ["--for"]),
        ("fulmar no_such_command", [""]),
    ],
)
def test_bash_completes_what_was_begun(home, words, expected):
    script = ASK.format(words=words, last=len(words.split()) - 1)
    done = subprocess.run(
        ["bash", "-c", script], env=_environment(home), capture_output=True, text=True, check=True
    )
    assert done.stdout.split("\n")[:-1] == expected


def _environment(home):
    return os.environ | {"HOME": str(home), "PATH": f"{FULMAR.parent}:{os.environ['PATH']}"}
