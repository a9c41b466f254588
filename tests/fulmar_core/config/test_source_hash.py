"""Hashes of what a certified set was measured with."""

from __future__ import annotations

import re

import pytest

from fulmar_core.config.paths import config_names, config_path
from fulmar_core.config.source_hash import robot_sha256


@pytest.mark.parametrize("robot", config_names("robots"))
def test_the_file_of_every_robot_has_a_hash(robot):
    assert re.fullmatch("[0-9a-f]{64}", robot_sha256(robot))


def test_a_coefficient_of_an_aircraft_changes_its_hash(monkeypatch, tmp_path):
    text = config_path("robots", "airship_v7").read_text()
    assert text.count("1: 0.5346827\n") == 1  # the constant term of a polynomial, whose key is a number
    changed = tmp_path / "airship_v7.yaml"
    changed.write_text(text.replace("1: 0.5346827\n", "1: 0.5346828\n"))
    before = robot_sha256("airship_v7")
    monkeypatch.setattr("fulmar_core.config.source_hash.config_path", lambda *_: changed)
    assert robot_sha256("airship_v7") != before
