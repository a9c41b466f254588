"""How this Fulmar was installed, and the commands that add an extra to it and repair it."""

from __future__ import annotations

import json
import shlex
import sys
import tomllib
from collections.abc import Sequence
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit
from urllib.request import url2pathname

EXTRAS_OF_SETUP = (
    "ros",
    "sim",
    "policy",
    "bags",
    "hardware",
    "view",
    "console",
)  # the extra `run`, as `make setup` installs it
# Distributions that are not called as the module they bring.
DISTRIBUTIONS = {
    "mcap_ros2": "mcap-ros2-support",
    "serial": "pyserial",
    "stable_baselines3": "stable-baselines3",
}


def install_command(extras: Sequence[str], modules: Sequence[str]) -> str:
    """Shell command that adds extras to this installation.

    It names the file that this Fulmar came from: `fulmar` is the name of another project on the Python Package Index.

    Args:
        extras: Names of the extras, such as `sim`; several of those that `run` has become `run`.
        modules: The missing modules, for an installation without extras: a colcon workspace.
    """
    try:
        own = distribution("fulmar")
    except PackageNotFoundError:
        return _for_a_workspace(extras, modules)
    wanted, origin = _shortest(extras), _origin(own)
    folder = _checkout(origin)
    if folder is not None:
        return _for_a_checkout(folder, wanted)
    if _receipt().is_file():
        return f"uv tool install {_requirement(own, origin, [*_extras_of(_receipt()), *wanted])}"
    return f"{_pip()} {_requirement(own, origin, wanted)}"


def repair_command(folder: str) -> str:
    """Shell command that restores files that came with this Fulmar.

    Args:
        folder: Where a checkout has them, from its root.
    """
    try:
        own = distribution("fulmar")
    except PackageNotFoundError:
        return "colcon build   # in the workspace"
    origin = _origin(own)
    checkout = _checkout(origin)
    if checkout is not None:
        return f"git -C {shlex.quote(str(checkout))} restore {folder}"
    if _receipt().is_file():
        again = _requirement(own, origin, _extras_of(_receipt()))
        return f"uv tool install --reinstall-package fulmar {again}"
    again = "--force-reinstall" if find_spec("pip") else "--reinstall"
    return f"{_pip()} {again} --no-deps {_requirement(own, origin, [])}"


def _origin(own: Distribution) -> dict[str, Any]:
    """Where it was installed from, as PEP 610 records it; empty for a package index."""
    return json.loads(own.read_text("direct_url.json") or "{}")


def _checkout(origin: dict[str, Any]) -> Path | None:
    if not origin.get("dir_info", {}).get("editable"):
        return None
    return Path(url2pathname(urlsplit(origin["url"]).path))


def _receipt() -> Path:
    """What `uv tool` leaves in the environments that it makes."""
    return Path(sys.prefix) / "uv-receipt.toml"


def _shortest(extras: Sequence[str]) -> list[str]:
    """The same extras, or more than half of what `run` has by that name."""
    of_run = [extra for extra in extras if extra in EXTRAS_OF_SETUP]
    if 2 * len(of_run) <= len(EXTRAS_OF_SETUP):
        return list(extras)
    return ["run", *(extra for extra in extras if extra not in of_run)]


def _for_a_workspace(extras: Sequence[str], modules: Sequence[str]) -> str:
    """On a Jazzy machine ROS comes with its own shell setup, and the rest from pip."""
    names = [DISTRIBUTIONS.get(module, module) for module in modules]
    sourced = ["source /opt/ros/jazzy/setup.bash"] if "ros" in extras else []
    others = [name for name in names if name != "rclpy" and not name.endswith("_msgs")]
    installed = [f"pip install --break-system-packages {' '.join(others)}"] if others else []
    return " && ".join([*sourced, *installed])


def _for_a_checkout(folder: Path, extras: Sequence[str]) -> str:
    if Path(sys.prefix).resolve() == (folder / ".venv").resolve():
        target = _target(extras)
        return f"make {target}" if folder == Path.cwd() else f"make -C {shlex.quote(str(folder))} {target}"
    return f"{_pip()} -e {shlex.quote(str(folder) + _in_brackets(extras))}"


def _target(extras: Sequence[str]) -> str:
    """The target of make that brings extras: the smallest, but for training, which is most of `make dev` anyway."""
    more = [extra for extra in extras if extra not in ("run", *EXTRAS_OF_SETUP)]
    if not more:
        return "setup"
    return "dev" if "train" in more else f"with EXTRA={shlex.quote(' '.join(more))}"


def _pip() -> str:
    """The installer of this interpreter's environment, which `uv venv` makes without pip."""
    if find_spec("pip") is None:
        return f"uv pip install --python {shlex.quote(sys.prefix)}"
    return f"{shlex.quote(sys.executable)} -m pip install"


def _requirement(own: Distribution, origin: dict[str, Any], extras: list[str]) -> str:
    """This very Fulmar with some extras: the file or address it came from, else its version."""
    name = f"fulmar{_in_brackets(extras)}"
    return shlex.quote(f"{name} @ {origin['url']}" if "url" in origin else f"{name}=={own.version}")


def _in_brackets(extras: Sequence[str]) -> str:
    return f"[{','.join(dict.fromkeys(extras))}]" if extras else ""


def _extras_of(receipt: Path) -> list[str]:
    """Extras that `uv tool` was asked for; it would remove those that the next command leaves out."""
    asked = tomllib.loads(receipt.read_text(encoding="utf-8"))["tool"]["requirements"]
    return [extra for one in asked if one["name"] == "fulmar" for extra in one.get("extras", [])]
