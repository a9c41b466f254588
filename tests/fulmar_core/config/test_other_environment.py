"""Environments of outside programs are found from whatever folder a command is called in."""

from __future__ import annotations

import pytest

from fulmar_core.config import other_environment
from fulmar_core.config.errors import ConfigError
from fulmar_core.config.other_environment import PEERS, peers_python


@pytest.mark.parametrize("where", ["checkout", "elsewhere"])
def test_the_environment_of_the_checkout_and_that_of_the_folder_are_found(tmp_path, monkeypatch, where):
    for folder in ("checkout", "elsewhere"):
        (tmp_path / folder).mkdir()
    monkeypatch.setattr(other_environment, "config_directory", lambda: tmp_path / "checkout" / "configs")
    monkeypatch.chdir(tmp_path / "elsewhere")
    with pytest.raises(ConfigError, match=r"runs there, and .*is missing\. Run: make peers"):
        peers_python("A lattice runs there")
    python = tmp_path / where / PEERS / "bin" / "python"
    python.parent.mkdir(parents=True)
    python.touch()
    assert peers_python("A lattice runs there") == python
