"""How this Fulmar was installed, and the command that adds an extra to it."""

from __future__ import annotations

import json
import shlex
import sys
import tomllib
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


def install_command(extra: str, module: str) -> str:
    """Shell command that adds an extra to this installation.

    It names the file that this Fulmar came from: `fulmar` is the name of another project on the Python Package Index.

    Args:
        extra: Name of the extra, such as `sim`.
        module: The missing module, for an installation without extras: a colcon workspace.
    """
    try:
        own = distribution("fulmar")
    except PackageNotFoundError:
        if extra == "ros":
            return "source /opt/ros/jazzy/setup.bash"
        return f"pip install --break-system-packages {DISTRIBUTIONS.get(module, module)}"
    origin = json.loads(own.read_text("direct_url.json") or "{}")
    if origin.get("dir_info", {}).get("editable"):
        return _for_a_checkout(Path(url2pathname(urlsplit(origin["url"]).path)), extra)
    receipt = Path(sys.prefix) / "uv-receipt.toml"
    if receipt.is_file():
        return f"uv tool install {_requirement(own, origin, [*_extras_of(receipt), extra])}"
    return f"{_pip()} {_requirement(own, origin, [extra])}"


def _for_a_checkout(folder: Path, extra: str) -> str:
    if Path(sys.prefix).resolve() == (folder / ".venv").resolve():
        target = "setup" if extra in EXTRAS_OF_SETUP else "dev"
        return f"make {target}" if folder == Path.cwd() else f"make -C {shlex.quote(str(folder))} {target}"
    return f"{_pip()} -e {shlex.quote(f'{folder}[{extra}]')}"


def _pip() -> str:
    """The installer of this interpreter's environment, which `uv venv` makes without pip."""
    if find_spec("pip") is None:
        return f"uv pip install --python {shlex.quote(sys.prefix)}"
    return f"{shlex.quote(sys.executable)} -m pip install"


def _requirement(own: Distribution, origin: dict[str, str], extras: list[str]) -> str:
    """This very Fulmar with some extras: the file or address it came from, else its version."""
    name = f"fulmar[{','.join(dict.fromkeys(extras))}]"
    return shlex.quote(f"{name} @ {origin['url']}" if "url" in origin else f"{name}=={own.version}")


def _extras_of(receipt: Path) -> list[str]:
    """Extras that `uv tool` was asked for; it would remove those that the next command leaves out."""
    asked = tomllib.loads(receipt.read_text(encoding="utf-8"))["tool"]["requirements"]
    return [extra for one in asked if one["name"] == "fulmar" for extra in one.get("extras", [])]
