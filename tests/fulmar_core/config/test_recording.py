"""The recorder's section of a system file refuses what cannot be kept."""

from __future__ import annotations

import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.recording import Recording
from fulmar_core.config.strict_yaml import load_config


def read(tmp_path, text):
    (tmp_path / "r.yaml").write_text(text)
    return load_config(Recording, tmp_path / "r.yaml")


def test_a_ring_is_asked_for_in_one_line(tmp_path):
    assert read(tmp_path, "mode: ring\n") == Recording(mode="ring", before_fault_s=30.0)


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("mode: rnig\n", "rnig"),
        ("before_fault_s: 0.0\n", "before_fault_s"),
        ("after_fault_s: -1.0\n", "after_fault_s"),
        ("split_mb: -1.0\n", "split_mb"),
        ("split_s: .inf\n", "split_s"),
    ],
)
def test_what_cannot_be_kept_is_refused_by_name(tmp_path, text, named):
    with pytest.raises(ConfigError, match=named):
        read(tmp_path, text)


@pytest.mark.parametrize("value", ["whole ", "all", ""])
def test_a_parameter_of_the_node_with_an_unknown_mode_is_refused(value):
    with pytest.raises(ValueError, match="whole, ring"):
        Recording(mode=value)
