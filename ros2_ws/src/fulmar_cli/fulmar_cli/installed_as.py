"""How this Fulmar was installed, and the command that adds an extra to it."""

from __future__ import annotations

import json
import shlex
import sys
import tomllib
from collections.abc import Sequence
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from importlib.util import find_spec
from pathlib import Path
from urllib.parse import urlsplit
from urllib.request import url2pathname

EXTRAS_OF_SETUP = (
    "ros",
    "sim",
    "policy",
    "bags",
    "hardware",
    "view",
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
    wanted = _shortest(extras)
    origin = json.loads(own.read_text("direct_url.json") or "{}")
    if origin.get("dir_info", {}).get("editable"):
        return _for_a_checkout(Path(url2pathname(urlsplit(origin["url"]).path)), wanted)
    receipt = Path(sys.prefix) / "uv-receipt.toml"
    if receipt.is_file():
        return f"uv tool install {_requirement(own, origin, [*_extras_of(receipt), *wanted])}"
    return f"{_pip()} {_requirement(own, origin, wanted)}"


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
        target = "setup" if set(extras) <= {"run", *EXTRAS_OF_SETUP} else "dev"
        return f"make {target}" if folder == Path.cwd() else f"make -C {shlex.quote(str(folder))} {target}"
    return f"{_pip()} -e {shlex.quote(str(folder) + _in_brackets(extras))}"


def _pip() -> str:
    """The installer of this interpreter's environment, which `uv venv` makes without pip."""
    if find_spec("pip") is None:
        return f"uv pip install --python {shlex.quote(sys.prefix)}"
    return f"{shlex.quote(sys.executable)} -m pip install"


def _requirement(own: Distribution, origin: dict[str, str], extras: list[str]) -> str:
    """This very Fulmar with some extras: the file or address it came from, else its version."""
    name = f"fulmar{_in_brackets(extras)}"
    return shlex.quote(f"{name} @ {origin['url']}" if "url" in origin else f"{name}=={own.version}")


def _in_brackets(extras: Sequence[str]) -> str:
    return f"[{','.join(dict.fromkeys(extras))}]"


def _extras_of(receipt: Path) -> list[str]:
    """Extras that `uv tool` was asked for; it would remove those that the next command leaves out."""
    asked = tomllib.loads(receipt.read_text(encoding="utf-8"))["tool"]["requirements"]
    return [extra for one in asked if one["name"] == "fulmar" for extra in one.get("extras", [])]
