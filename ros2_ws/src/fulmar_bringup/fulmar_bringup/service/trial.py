"""Tries what a unit would start: as its user, in an empty folder, with nothing but its environment."""

from __future__ import annotations

import os
import pwd
import subprocess
import tempfile
from collections.abc import Mapping
from typing import Any

from fulmar_bringup.service.unit import Service
from fulmar_core.config.errors import ConfigError

DRY_RUN = "--dry-run"  # of `fulmar up`: everything is checked, and nothing starts
PATH = "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin"  # that systemd gives, systemd.exec(5)
TRIED_S = 120.0  # for a busy computer


def try_once(service: Service, variables: Mapping[str, str], *, as_user: bool) -> None:
    """Run a service's command up to the point where it would start nodes.

    Args:
        service: What runs.
        variables: Its environment, as in `variables_of`.
        as_user: Whether its user is one of this computer, and we may become it.

    Raises:
        ConfigError: It does not start; the message has what the service printed.
    """
    try:
        about = pwd.getpwnam(service.user) if as_user else pwd.getpwuid(os.geteuid())
    except KeyError:
        raise ConfigError(f"the user id {os.geteuid()} has no name here. Add one to /etc/passwd.") from None
    becoming: dict[str, Any] = {}
    if as_user:
        becoming = {
            "user": about.pw_uid,
            "group": about.pw_gid,
            "extra_groups": os.getgrouplist(about.pw_name, about.pw_gid),
        }
    with tempfile.TemporaryDirectory(prefix="fulmar_service_") as folder:
        if as_user:
            os.chown(folder, about.pw_uid, about.pw_gid)
        given = {
            "PATH": PATH,
            "HOME": about.pw_dir,
            "USER": about.pw_name,
            **variables,
            "ROS_LOG_DIR": folder,
        }
        try:
            done = subprocess.run(
                [*service.command, DRY_RUN], cwd=folder, env=given, stdin=subprocess.DEVNULL, capture_output=True,
                text=True, errors="replace", timeout=TRIED_S, check=False, **becoming,
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            return
        except OSError as error:
            raise ConfigError(
                f"'{about.pw_name}' cannot run {service.command[0]} ({error.strerror}). Install Fulmar where that user "
                "may read it."
            ) from error
    if done.returncode:
        said = (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1]
        raise ConfigError(
            f"the service would not start, and nothing was written: as '{about.pw_name}', in a folder of its own and "
            f"with its own environment, it says: {said.removeprefix('fulmar: ')}"
        )
