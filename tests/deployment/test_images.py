"""The container images, built for real by docker/build.sh, and Fulmar running in them as their user."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import psutil
import pytest

USER_ID = 1000
LARGEST_ROBOT_MB = 1200
CERTIFICATES = "usr/share/ca-certificates/mozilla"  # those of Debian's package
# How buildah reaches package registries on this machine; neither ends up in the image.
MOUNTS = "-v /etc/ssl/certs:/etc/ssl/certs:ro -v /etc/resolv.conf:/etc/resolv.conf:ro"
STORAGE = '[storage]\ndriver = "{driver}"\ngraphroot = "{folder}/images"\nrunroot = "{folder}/run"\n'
# Runs a command of an image's file system as an engine with `read_only` does: $1 is the root, $2 the volume.
READ_ONLY = f"""
set -eu
mount --bind "$1" "$1"
mount -o remount,bind,ro "$1"
mount -t proc proc "$1/proc"
mount --rbind /dev "$1/dev"
mount -t tmpfs -o mode=1777 tmp "$1/tmp"
mount --bind "$2" "$1/runs"
root=$1
shift 2
exec chroot --userspec={USER_ID}:{USER_ID} "$root" /usr/bin/env "$@"
"""

pytestmark = pytest.mark.slow


@dataclass(frozen=True)
class Images:
    """Images in a storage of their own."""

    environment: dict[str, str]

    def buildah(self, *arguments: str, timeout_s: float = 120.0) -> subprocess.CompletedProcess[str]:
        """Run buildah to its end."""
        return subprocess.run(
            ["buildah", *arguments],
            env=self.environment,
            capture_output=True,
            text=True,
            timeout=timeout_s,
            check=False,
        )

    @contextmanager
    def container(self, image: str) -> Iterator[str]:
        """A container of an image, which is removed afterwards."""
        name = self.buildah("from", f"localhost/fulmar:{image}").stdout.strip()
        try:
            yield name
        finally:
            self.buildah("rm", name)

    @contextmanager
    def root(self, image: str) -> Iterator[Path]:
        """The file system of an image."""
        with self.container(image) as name:
            yield Path(self.buildah("mount", name).stdout.strip())
            self.buildah("umount", name)

    def run(
        self, image: str, *command: str, volume: Path, timeout_s: float = 300.0
    ) -> subprocess.CompletedProcess[str]:
        """Run a command in a container of an image, with a folder as /runs."""
        with self.container(image) as name:
            return self.buildah(
                "run", "--volume", f"{volume}:/runs", name, "--", *command, timeout_s=timeout_s
            )


@pytest.fixture(scope="module")
def images(repository: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Images]:
    """The images `robot` and `sim`, with the layers of the storage that CONTAINERS_STORAGE_CONF names, if it is set."""
    for program in ("buildah", "debootstrap"):
        assert shutil.which(program), f"apt install {program}: the images are built for real"
    folder = tmp_path_factory.mktemp("containers")
    driver = "vfs" if os.environ.get("STORAGE_DRIVER") == "vfs" else "overlay"
    (folder / "storage.conf").write_text(STORAGE.format(driver=driver, folder=folder))
    environment = {
        **os.environ,
        "ENGINE": "buildah",
        "MOUNTS": MOUNTS,
        "BUILDAH_ISOLATION": "chroot",
    }
    own = "CONTAINERS_STORAGE_CONF" not in environment
    environment.setdefault("CONTAINERS_STORAGE_CONF", str(folder / "storage.conf"))
    made = Images(environment)
    try:
        built = subprocess.run(
            [repository / "docker/build.sh", "robot", "sim"],
            env=environment,
            capture_output=True,
            text=True,
            timeout=1500.0,
            check=False,
        )
        assert built.returncode == 0, built.stdout[-2000:] + built.stderr[-3000:]
        yield made
    finally:
        if own:
            made.buildah("rm", "--all")
            made.buildah("rmi", "--all", "--force")


@pytest.fixture
def volume(tmp_path: Path) -> Path:
    """An empty folder of the images' user."""
    made = tmp_path / "volume"
    made.mkdir()
    os.chown(made, USER_ID, USER_ID)
    for parent in (made, *made.parents[:3]):
        parent.chmod(parent.stat().st_mode | 0o055)  # pytest's folders are closed to other users
    return made


@pytest.mark.timeout(2000)
def test_the_demo_runs_in_the_image_sim_and_leaves_bags_and_a_report_in_the_volume(images, volume):
    done = images.run("sim", "tini", "-s", "--", "fulmar", "demo", volume=volume)
    assert done.returncode == 0, done.stdout + done.stderr
    (run,) = volume.iterdir()
    assert (run / "report.html").stat().st_size > 10_000
    for controller in ("policy", "lqr"):
        assert list((run / controller).glob("*.mcap"))
    assert {path.stat().st_uid for path in volume.rglob("*")} == {USER_ID}


def test_the_image_robot_is_small_and_has_no_torch_no_compiler_and_no_pip(images, volume):
    listed = images.buildah("images", "--format", "{{.Size}}", "localhost/fulmar:robot").stdout
    size, unit = re.fullmatch(r"([\d.]+) (MB|GB)\n", listed).groups()
    assert float(size) * (1000 if unit == "GB" else 1) <= LARGEST_ROBOT_MB
    print(f"robot: {listed.strip()}")  # noqa: T201 - shown with -s, and after a failure
    look = "import importlib.util as u; print([m for m in ('torch', 'pip', 'mujoco') if u.find_spec(m)])"
    assert images.run("robot", "python", "-c", look, volume=volume).stdout.strip() == "[]"
    for program, is_there in {"fulmar": True, "cc": False, "g++": False, "git": False, "pip": False}.items():
        assert (images.run("robot", "which", program, volume=volume).returncode == 0) is is_there, program
    assert images.run("robot", "fulmar", "list", "systems", volume=volume).returncode == 0
    assert images.run("robot", "python", "-c", "import tf2_msgs.msg", volume=volume).returncode == 0


@pytest.mark.parametrize("image", ["robot", "sim"])
def test_an_image_has_a_user_who_is_not_root_and_nothing_of_the_machine_that_built_it(image, images):
    shown = json.loads(images.buildah("inspect", "--type", "image", f"localhost/fulmar:{image}").stdout)
    config = shown["OCIv1"]["config"]
    assert config["User"] == f"{USER_ID}:{USER_ID}"
    assert config["Entrypoint"][-1] == "fulmar"
    assert config["Labels"]["org.opencontainers.image.licenses"] == "Apache-2.0"
    assert config["Labels"]["org.opencontainers.image.version"] == version("fulmar")
    assert not [entry for entry in config["Env"] if re.match("PIP_|SSL_|.*PROXY", entry, re.IGNORECASE)]
    with images.root(image) as root:
        assert not (root / "etc/pip.conf").exists()
        assert not (root / "src").exists()
        assert (root / "etc/resolv.conf").read_text() == ""
        assert not list((root / "usr/local/share/ca-certificates").glob("*"))
        trusted = (root / "etc/ssl/certs/ca-certificates.crt").read_text()
        of_debian = [path.read_text().strip() for path in (root / CERTIFICATES).glob("*.crt")]
        assert trusted.count("BEGIN CERTIFICATE") == len(of_debian) > 0
        assert all(each in trusted for each in of_debian)


def test_a_volume_that_cannot_be_written_is_one_line(images, tmp_path, volume):
    os.chown(volume, 0, 0)
    volume.chmod(0o755)
    done = images.run("sim", "fulmar", "demo", volume=volume)
    assert done.returncode != 0
    words = [line for line in done.stderr.splitlines() if line.startswith("fulmar: ")]
    assert len(words) == 1
    assert "runs" in words[0]
    assert "ermission denied" in words[0]
    assert "Traceback" not in done.stdout + done.stderr


def test_a_device_that_is_not_there_is_one_line(images, volume):
    done = images.run(
        "robot", "fulmar", "run", "turtlebot2", "--backend", "hardware", "--goal", "1,0", volume=volume
    )
    assert done.returncode == 1
    assert "Traceback" not in done.stdout + done.stderr
    (words,) = [line for line in done.stderr.splitlines() if line.startswith("fulmar: ")]
    assert "/dev/" in words


def test_sigterm_to_the_first_process_of_a_container_stops_its_system_in_order(images, volume):
    words = ("fulmar", "up", "mock_lqr", "--json", "--record", "runs/one")
    with images.container("robot") as name:
        running = psutil.Popen(
            ["buildah", "run", "--volume", f"{volume}:/runs", name, "--", "tini", "-s", "--", *words],
            env=images.environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        try:
            first = json.loads(running.stdout.readline())
            assert first["event"] == "started"
            (init,) = [each for each in running.children(recursive=True) if each.name() == "tini"]
            nodes = init.children(recursive=True)
            assert len(nodes) >= 4  # fulmar, plant, controller, recorder
            init.send_signal(signal.SIGTERM)
            output, errors = running.communicate(timeout=20.0)
        finally:
            for process in [*running.children(recursive=True), running] if running.poll() is None else []:
                process.kill()
    assert running.returncode == 0, output + errors
    stopping, stopped = [json.loads(line) for line in output.splitlines()[-2:]]
    assert (stopping["event"], stopping["reason"]) == ("stopping", "stopped by SIGTERM")
    assert (stopped["event"], stopped["failure"]) == ("stopped", None)
    assert not [process for process in nodes if process.is_running()]
    assert list((volume / "one").glob("*.mcap"))


def test_the_image_robot_runs_the_controller_of_a_simulated_plant_without_a_simulator(images, volume):
    words = (
        "timeout",
        "--signal=TERM",
        "15",
        "fulmar",
        "up",
        "mujoco_lqr",
        "--estop",
        "--only",
        "controller",
    )
    done = images.run("robot", *words, volume=volume)
    assert "waiting for the plant of 'floating_platform'" in done.stdout + done.stderr
    assert "Traceback" not in done.stdout + done.stderr


def test_a_run_needs_no_writable_root(images, volume):
    config = json.loads(images.buildah("inspect", "--type", "image", "localhost/fulmar:sim").stdout)
    variables = config["OCIv1"]["config"]["Env"]
    asked = ("fulmar", "run", "floating_platform", "--controller", "lqr", "--goal", "0.3,0,0", "--lockstep")
    with images.root("sim") as root:
        done = subprocess.run(
            ["unshare", "--mount", "bash", "-c", READ_ONLY, "read_only", root, str(volume), "-i", *variables,
             *asked, "--record", "runs/one"],
            capture_output=True,
            text=True,
            timeout=110.0,
            check=False,
        )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    assert list((volume / "one").glob("*.mcap"))
