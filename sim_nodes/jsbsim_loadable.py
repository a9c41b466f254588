"""Whether JSBSim can be loaded here, which a package that is installed does not say."""

from __future__ import annotations

from importlib import import_module

from fulmar_core.config.errors import ConfigError


def check_jsbsim() -> None:
    """Refuse to go on where JSBSim is installed and cannot be loaded.

    Raises:
        ConfigError: With what its import says, in one line.
    """
    try:
        import_module("jsbsim")
    except Exception as error:
        words = " ".join(str(error).split())
        said = f"{type(error).__name__}: {words}" if words else type(error).__name__
        raise ConfigError(
            f"JSBSim is installed and cannot be loaded ({said}). Install it again with pip install --force-reinstall "
            "jsbsim, or take --backend mujoco."
        ) from error
