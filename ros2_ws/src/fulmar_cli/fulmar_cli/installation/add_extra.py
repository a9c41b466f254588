"""Adds extras to the environment of a checkout, in the versions and with the hashes of its development lock.

    make with EXTRA=jsbsim

What an extra asks for in turn is read once it is installed, and added if it is missing, until nothing is.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from importlib import invalidate_caches
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from fulmar_core.config.errors import BAD_USAGE, DONE, ConfigError, FulmarError, UnknownNameError

LOCK = Path("requirements-dev.lock")
PIN = re.compile(r"([\w.-]+)(?:\[[^]]*\])?==(\S+)")
PIP = (sys.executable, "-m", "pip", "install", "--disable-pip-version-check", "--no-input", "--quiet")


def pins_of(lock: str) -> dict[str, str]:
    """Lines of each package of a lock, version and hashes, by its name."""
    blocks = re.split(r"\n(?=\S)", lock.strip())
    return {canonicalize_name(pin[1]): block for block in blocks if (pin := PIN.match(block))}


def asked_by(package: str, extras: Sequence[str] = ()) -> list[Requirement]:
    """What an installed package asks for on this computer, with some of its extras."""
    asked = [Requirement(line) for line in requires(package) or ()]
    chosen = tuple(extras) or ("",)
    return [
        one for one in asked if one.marker is None or any(one.marker.evaluate({"extra": e}) for e in chosen)
    ]


def check_extras(extras: Sequence[str]) -> None:
    """Refuse what is no extra of Fulmar.

    Raises:
        ConfigError: None is named.
        UnknownNameError: With those that there are.
    """
    found = {name for line in requires("fulmar") or () for name in re.findall(r"extra == ['\"](\w+)", line)}
    if not extras:
        raise ConfigError(f"name an extra: make with EXTRA=jsbsim. Known: {', '.join(sorted(found))}.")
    for extra in extras:
        if extra not in found:
            raise UnknownNameError("extra", extra, found)


def add(extras: Sequence[str], pins: dict[str, str]) -> list[str]:
    """Install extras and what they ask for; returns the packages that were missing.

    Raises:
        ConfigError: No such extra, or the lock lacks a package.
        FulmarError: pip failed; it has said why.
    """
    check_extras(extras)
    added: list[str] = []
    seen: set[tuple[str, tuple[str, ...]]] = set()
    level = {("fulmar", tuple(extras))}
    while level:
        seen |= level
        asked = [one for package, chosen in level for one in asked_by(package, chosen)]
        names = sorted({canonicalize_name(one.name) for one in asked})
        if lacking := [name for name in names if name not in pins]:
            raise ConfigError(f"{LOCK} has no {', '.join(lacking)}. Make it anew: make lock")
        if missing := [name for name in names if not _is_here(name, pins[name])]:
            _install([pins[name] for name in missing])
            added += missing
        level = {(str(canonicalize_name(one.name)), tuple(sorted(one.extras))) for one in asked} - seen
    return added


def _is_here(name: str, pinned: str) -> bool:
    pin = PIN.match(pinned)
    try:
        return pin is not None and version(name) == pin[2]
    except PackageNotFoundError:
        return False


def _install(pins: list[str]) -> None:
    """Let pip install exactly these packages.

    Raises:
        FulmarError: It failed.
    """
    with tempfile.NamedTemporaryFile("w", suffix=".lock", encoding="utf-8") as file:
        file.write("\n".join((*pins, "")))
        file.flush()
        command = [*PIP, "--no-deps", "--require-hashes", "-r", file.name]
        if subprocess.run(command, check=False).returncode:
            raise FulmarError("pip could not install it, see above.")
    invalidate_caches()


def main() -> int:
    """Add the extras that the command line names."""
    try:
        added = add(sys.argv[1:], pins_of(LOCK.read_text(encoding="utf-8")))
    except FulmarError as error:
        sys.stderr.write(f"{error}\n")
        return BAD_USAGE
    sys.stdout.write(f"Added {', '.join(added)}.\n" if added else "It is there already.\n")
    return DONE


if __name__ == "__main__":
    sys.exit(main())
