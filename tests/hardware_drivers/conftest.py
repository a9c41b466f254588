"""A folder for a user's own classes; and random bytes, the same in every run, with no clock on them.

A busy machine is no mistake of a decoder.
"""

from __future__ import annotations

import pytest
from hypothesis import settings

from tests.own_files import own_folder

settings.register_profile("bench", deadline=None, derandomize=True)
settings.load_profile("bench")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    with own_folder(tmp_path, monkeypatch):
        yield tmp_path
