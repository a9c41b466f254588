"""A JSBSim that is installed and cannot be loaded is one line with what its import says."""

from __future__ import annotations

import pytest

from fulmar_cli.installation.extras import require
from fulmar_core.config.errors import ConfigError


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (ImportError("libstdc++.so.6:\n cannot open"), "ImportError: libstdc++.so.6: cannot open"),
        (RuntimeError("no CPU of this kind"), "RuntimeError: no CPU of this kind"),
        (OSError(), "OSError"),
    ],
)
def test_a_jsbsim_that_cannot_be_loaded_is_refused_with_the_reason_of_its_import(monkeypatch, error, said):
    def fail(_name: str) -> None:
        raise error

    monkeypatch.setattr("sim_nodes.jsbsim_loadable.import_module", fail)
    with pytest.raises(ConfigError) as refused:
        require("jsbsim")
    assert f"JSBSim is installed and cannot be loaded ({said})." in str(refused.value)
    assert "\n" not in str(refused.value)
