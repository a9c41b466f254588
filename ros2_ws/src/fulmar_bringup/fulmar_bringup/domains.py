"""ROS domains that no other process of this computer uses."""

from __future__ import annotations

import contextlib
import fcntl
import os
import random
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import TextIO

from fulmar_core.config.errors import ConfigError
from fulmar_core.config.process import environment
from fulmar_ros.ros_check import domain_problem

DOMAINS = range(1, 102)  # up to 101 the ports of a domain lie below those that Linux hands out to others


@contextlib.contextmanager
def reserved_domains(count: int) -> Iterator[list[int]]:
    """Reserve `count` domains until the context ends, and give their ids.

    A lock file for each keeps processes of this user apart; the lock ends with the process.

    Raises:
        ConfigError: So many are not free.
    """
    folder = _lock_folder()
    reserved: list[int] = []
    with contextlib.ExitStack() as locks:
        for domain in random.sample(DOMAINS, len(DOMAINS)):
            if len(reserved) == count:
                break
            lock = locks.enter_context((folder / str(domain)).open("w"))
            if _locked(lock) and not _run_goes_on(folder, domain):
                reserved.append(domain)
        if len(reserved) < count:
            raise ConfigError(
                f"{count} free ROS domains are needed, {len(reserved)} were found. Use fewer --jobs."
            )
        yield reserved


@contextlib.contextmanager
def claimed_domain(name: str, part: str = "") -> Iterator[int]:
    """Claim a robot's name in the domain of the environment until the context ends, and give the domain id.

    Two runs of one name would mix. Not the lock of `reserved_domains`: a run may take place in a domain that its
    parent process reserved for it. Plant and controller of a system on one computer have a lock each: `part`.

    Raises:
        ConfigError: Another run of this user has the name in it, or ROS_DOMAIN_ID is no domain.
    """
    if problem := domain_problem(os.environ):
        raise ConfigError(f"{problem}.")
    domain, folder = int(os.environ.get("ROS_DOMAIN_ID") or 0), _lock_folder()
    own = ".".join(filter(None, (name, part)))
    with _run_lock_file(folder, domain) as shared, (folder / f"{domain}.{own}.run").open("w") as lock:
        fcntl.flock(shared, fcntl.LOCK_SH)  # waits for no more than a look of `reserved_domains`
        if not _locked(lock):
            raise ConfigError(
                f"another `fulmar run` is using ROS domain {domain} for '{own}', and two of one name would mix. "
                "Wait for it to end, give this robot another --name, or set ROS_DOMAIN_ID to another number."
            )
        yield domain


@contextlib.contextmanager
def own_domain() -> Iterator[dict[str, str]]:
    """A reserved domain for this process and its children until the context ends; gives their environment.

    Raises:
        ConfigError: None is free.
    """
    with reserved_domains(1) as (number,):
        own = {"ROS_DOMAIN_ID": str(number), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
        with environment(own):
            yield own


def _lock_folder() -> Path:
    folder = Path(tempfile.gettempdir()) / f"fulmar_ros_domains_{os.getuid()}"
    folder.mkdir(exist_ok=True)
    return folder


def _run_lock_file(folder: Path, domain: int) -> TextIO:
    return (folder / f"{domain}.run").open("w")


def _run_goes_on(folder: Path, domain: int) -> bool:
    with _run_lock_file(folder, domain) as lock:
        return not _locked(lock)


def _locked(lock: TextIO) -> bool:
    """Take a lock that lasts until the file is closed; False if somebody has it."""
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True
