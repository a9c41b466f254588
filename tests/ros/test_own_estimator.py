"""An estimator of the user's own, from a folder outside the checkout, between plant and controller."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from mcap.reader import make_reader

from tests.conftest import RosDomain
from tests.ros.cli import fulmar, json_of

PAGE = Path(__file__).resolve().parents[2] / "docs" / "own-estimator.md"
RUN = ("run", "floating_platform", "--controller", "lqr", "--lockstep", "--record", "bag", "--json")


@pytest.mark.slow
def test_the_robot_follows_the_estimator_of_the_page_and_its_source_is_in_the_bag(
    ros_domain: RosDomain, tmp_path: Path
) -> None:
    code = re.search(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert code is not None
    (tmp_path / "my_estimate.py").write_text(code.group(1))
    (tmp_path / "my_estimate.yaml").write_text("poses: 3\n")
    own = ("--estimator", "my_estimate:MeanPose", "--duration", "40")
    done = fulmar(*RUN, *own, env=ros_domain.env, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert json_of(done.stdout)["success"]
    with next((tmp_path / "bag").glob("*.mcap")).open("rb") as stream:
        files = {file.name: file.data for file in make_reader(stream).iter_attachments()}
    assert files["estimator.py"].decode() == code.group(1)
