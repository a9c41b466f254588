"""Which commit a record names."""

from __future__ import annotations

import shutil
import subprocess

from fulmar_core.config import provenance


def test_a_revision_is_only_given_for_a_file_that_the_repository_holds(monkeypatch, tmp_path):
    copy = tmp_path / "provenance.py"
    shutil.copy(provenance.__file__, copy)
    for words in (
        ["init"],
        ["-c", "user.name=x", "-c", "user.email=x@x", "commit", "--allow-empty", "-m", "x"],
    ):
        subprocess.run(["git", *words], cwd=tmp_path, check=True, capture_output=True)
    monkeypatch.setattr(provenance, "__file__", str(copy))
    revision = provenance.git_revision.__wrapped__  # without the memory of the checkout that the tests run in
    assert revision() == ""
    subprocess.run(["git", "add", copy.name], cwd=tmp_path, check=True, capture_output=True)
    assert revision().endswith("-dirty")
