"""Every command line of README and docs runs: the pages of the first of two processes."""

from __future__ import annotations

import pytest

from tests.conftest import RosDomain
from tests.docs.page_run import failures, pages_of


@pytest.mark.slow
@pytest.mark.timeout(1200)
@pytest.mark.parametrize("page", pages_of(0))
def test_every_command_of_the_page_runs(page: str, ros_domain: RosDomain, tmp_path) -> None:
    folder = tmp_path / page
    folder.mkdir()
    failed = failures(page, folder, ros_domain.id)
    assert not failed, f"{len(failed)} commands of {page} failed:\n" + "\n\n".join(failed)
