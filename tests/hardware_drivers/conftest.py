"""Random bytes, the same in every run, with no clock on them: a busy machine is no mistake of a decoder."""

from __future__ import annotations

from hypothesis import settings

settings.register_profile("bench", deadline=None, derandomize=True)
settings.load_profile("bench")
