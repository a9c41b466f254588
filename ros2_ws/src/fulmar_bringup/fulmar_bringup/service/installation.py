"""Writes, lists and removes the files of services; systemd itself is asked by `systemctl` where it runs."""

from __future__ import annotations

import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from fulmar_bringup.service.unit import MARK, command_of, system_of_unit
from fulmar_core.config.errors import ConfigError, FulmarError, UnknownNameError

UNITS = Path("etc/systemd/system")
RULES = Path("etc/udev/rules.d")
AT_BOOT = UNITS / "multi-user.target.wants"
RUNNING = Path("/run/systemd/system")  # there where systemd runs: sd_booted(3)


@dataclass(frozen=True)
class Files:
    """Files of one service, below a root."""

    root: Path
    name: str

    @property
    def unit(self) -> Path:
        """The unit."""
        return self.root / UNITS / f"fulmar-{self.name}.service"

    @property
    def link(self) -> Path:
        """What makes systemd start it at boot."""
        return self.root / AT_BOOT / self.unit.name

    @property
    def rules(self) -> Path:
        """Rules of its devices; after those of the system, which begin with lower numbers."""
        return self.root / RULES / f"70-fulmar-{self.name}.rules"


def texts_of(files: Files, unit: str, rules: Sequence[str]) -> dict[Path, str]:
    """Content of each file: of the unit, and of the rules if there are any."""
    return {files.unit: unit} | ({files.rules: "\n".join((MARK, *rules, ""))} if rules else {})


def write_files(files: Files, texts: Mapping[Path, str]) -> list[Path]:
    """Write unit and rules, and let the unit begin at boot.

    Args:
        files: Of the service.
        texts: As in `texts_of`.

    Returns:
        What was written.

    Raises:
        ConfigError: A file of that name is there which is not ours.
        FulmarError: A folder cannot be written.
    """
    for path in texts:
        if path.exists() and not _is_ours(path):
            raise ConfigError(f"{path} is not written by `fulmar service install`: rename it first.")
    try:
        for path, text in texts.items():
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
        if files.rules not in texts and _is_ours(files.rules):
            files.rules.unlink()  # of another installation under this name
        files.link.parent.mkdir(parents=True, exist_ok=True)
        files.link.unlink(missing_ok=True)
        files.link.symlink_to(Path("..") / files.unit.name)
    except OSError as error:
        raise FulmarError(f"{error.filename}: cannot be written: {error.strerror}. Use sudo.") from error
    return [*texts, files.link]


def installed(root: Path) -> list[str]:
    """Names of the services below a root."""
    units = sorted((root / UNITS).glob("fulmar-*.service"))
    return [unit.stem.removeprefix("fulmar-") for unit in units if _is_ours(unit)]


def _is_ours(path: Path) -> bool:
    """Whether a file is there, and written by `write_files`."""
    return path.is_file() and MARK in path.read_text(errors="replace")


def find(root: Path, name: str) -> Files:
    """The files of a service that is installed.

    Raises:
        ConfigError: None is.
        UnknownNameError: There is none of this name.
    """
    names = installed(root)
    if not names:
        raise ConfigError("no service is installed. `fulmar service install SYSTEM` installs one.")
    if name not in names:
        raise UnknownNameError("service", name, names)
    return Files(root, name)


def remove_files(files: Files) -> list[Path]:
    """Remove what `write_files` wrote; returns what was there.

    Raises:
        FulmarError: A file cannot be removed.
    """
    there = [path for path in (files.link, files.rules, files.unit) if path.is_symlink() or _is_ours(path)]
    try:
        for path in there:
            path.unlink()
    except OSError as error:
        raise FulmarError(f"{error.filename}: cannot be removed: {error.strerror}. Use sudo.") from error
    return there


def systemd_runs(root: Path) -> bool:
    """Whether systemd runs here and these are its files."""
    return root == Path("/") and RUNNING.is_dir()


def systemctl(*arguments: str) -> str:
    """What systemctl prints.

    Raises:
        FulmarError: It failed.
    """
    done = subprocess.run(["systemctl", *arguments], capture_output=True, text=True, check=False)
    if done.returncode and arguments[0] != "is-active":  # which says by its exit code what it prints
        raise FulmarError(f"systemctl {' '.join(arguments)}: {done.stderr.strip() or done.stdout.strip()}")
    return done.stdout.strip()


def state_of(files: Files) -> dict[str, str | bool]:
    """State of a service: its system, whether it begins at boot, and whether it runs."""
    text = files.unit.read_text()
    active = (
        systemctl("is-active", files.unit.name) if systemd_runs(files.root) else "systemd does not run here"
    )
    return {
        "name": files.name,
        "system": system_of_unit(text),
        "unit": str(files.unit),
        "at_boot": files.link.is_symlink(),
        "active": active,
        "command": " ".join(command_of(text)),
    }
