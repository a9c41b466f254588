"""`fulmar identify` on runs that state little: what they do not state gets into no calibration."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from fulmar_cli.main import app
from fulmar_core.config.errors import ConfigError
from fulmar_core.robots.calibration import load_calibration
from tests.synthetic_run import Plan, write_run


def identify(*words: object):
    return CliRunner().invoke(app, ["identify", *map(str, words)])


def boat(folder: Path, *, driven_s: float) -> Path:
    plan = Plan("kingfisher", "classical", "go_to_position", weights=None, silence_s=(driven_s, 1e9))
    return write_run(folder / "bag", plan)


@pytest.mark.slow
def test_a_boat_that_nobody_drove_gives_no_calibration(tmp_path):
    done = identify(boat(tmp_path, driven_s=0.0), "--out", tmp_path / "calibration.yaml")
    assert isinstance(done.exception, ConfigError), done.output
    assert not (tmp_path / "calibration.yaml").exists()


@pytest.mark.slow
def test_what_is_known_is_kept_and_what_the_run_does_not_state_is_named_and_left_out(tmp_path):
    out = tmp_path / "calibration.yaml"
    done = identify(boat(tmp_path, driven_s=3.0), "--known", "mass=35.0+-0.5", "--out", out, "--json")
    assert done.exit_code == 0, done.exception
    reported = json.loads(done.stdout[done.stdout.index("{") :])
    assert "surge_linear_drag" in reported["untold"]
    assert "the runs do not show" in done.stderr
    assert set(load_calibration(out).measured) == set(reported["estimates"]) - set(reported["untold"])
    assert load_calibration(out).mass is not None


@pytest.mark.slow
def test_damage_of_a_bag_is_named(tmp_path):
    bag = write_run(tmp_path / "bag", Plan())
    (bag / "bag_1.mcap").write_bytes(b"not a bag at all")
    assert "no MCAP file" in identify(bag).stderr
