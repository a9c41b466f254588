"""A bare Debian in a folder, made by debootstrap, and commands in it by a user who is not root.

Mounts belong to the mount namespace of one command, and its processes to a process namespace: nothing is left of either
when the command has ended, so removing the folder removes all of it.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

USER, USER_ID = "robin", 4242
CERTIFICATES = "etc/ssl/certs/ca-certificates.crt"  # those of this machine count in the root too
DEVICES = {
    "null": 3,
    "zero": 5,
    "full": 7,
    "random": 8,
    "urandom": 9,
}  # minor numbers of the kernel's memory devices
# Within the namespaces of a command: $1 is the root, $2 what the user runs.
ENTER = f"""
set -eu
mount -t proc proc "$1/proc"
mount -t tmpfs -o mode=0755 dev "$1/dev"
{"; ".join(f'mknod -m 666 "$1/dev/{name}" c 1 {minor}' for name, minor in DEVICES.items())}
mkdir "$1/dev/shm"
mount -t tmpfs -o mode=1777 shm "$1/dev/shm"
ln -s /proc/self/fd "$1/dev/fd"
for file in etc/resolv.conf {CERTIFICATES}; do touch "$1/$file"; mount --bind "$(realpath "/$file")" "$1/$file"; done
exec chroot --userspec={USER_ID}:{USER_ID} "$1" /bin/bash -c "$2"
"""


@dataclass(frozen=True)
class DebianRoot:
    """A Debian below a folder, with a user and the user's home."""

    folder: Path

    @property
    def home(self) -> Path:
        """The user's home, as this machine sees it."""
        return self.folder / "home" / USER

    def run(self, command: str, *, timeout_s: float) -> subprocess.CompletedProcess[str]:
        """Run a shell command as the user, from the user's home; both outputs become `stdout`.

        Raises:
            subprocess.TimeoutExpired: The command and all that it started were killed.
        """
        environment = {
            "HOME": f"/home/{USER}",
            "USER": USER,
            "PATH": f"/home/{USER}/.local/bin:/usr/local/bin:/usr/bin:/bin",
            "LANG": "C.UTF-8",
            **{name: f"/{CERTIFICATES}" for name in ("PIP_CERT", "SSL_CERT_FILE", "REQUESTS_CA_BUNDLE")},
        }
        namespaces = ["unshare", "--mount", "--pid", "--fork", "--kill-child"]
        words = ["env", "-i", *(f"{name}={value}" for name, value in environment.items())]
        inner = ENTER.replace("exec chroot", f"exec {' '.join(words)} {shutil.which('chroot')}")
        return subprocess.run(
            [*namespaces, "bash", "-c", inner, "enter", str(self.folder), f"cd && {command}"],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=timeout_s,
            check=False,
        )

    def take(self, source: Path) -> None:
        """Copy a file into the user's home."""
        target = shutil.copy(source, self.home)
        os.chown(target, USER_ID, USER_ID)

    def clone(self, repository: Path) -> None:
        """Clone a checkout's last commit into the user's home, as `fulmar`."""
        target = self.home / "fulmar"
        subprocess.run(["git", "clone", "--quiet", "--no-hardlinks", repository, target], check=True)
        subprocess.run(["chown", "-R", f"{USER_ID}:{USER_ID}", target], check=True)


def make_root(folder: Path, packages: Sequence[str] = (), suite: str = "bookworm") -> DebianRoot:
    """Make a minimal Debian with a user.

    Args:
        folder: Where; it must not exist.
        packages: Debian packages beside the minimum.
        suite: Debian's release.

    Raises:
        RuntimeError: debootstrap is not installed, this user is not root, or debootstrap failed.
    """
    if shutil.which("debootstrap") is None:
        raise RuntimeError("debootstrap is not installed. As root: apt install debootstrap")
    if os.geteuid() != 0:
        raise RuntimeError("a Debian root is made by root only: run this test as root.")
    include = ",".join(["ca-certificates", *packages])
    made = subprocess.run(
        ["debootstrap", "--variant=minbase", f"--include={include}", suite, str(folder)],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
    )
    if made.returncode != 0:
        raise RuntimeError(f"debootstrap failed:\n{made.stdout[-2000:]}{made.stderr}")
    subprocess.run(["chroot", folder, "useradd", "-m", "-u", str(USER_ID), USER], check=True)
    return DebianRoot(folder)
