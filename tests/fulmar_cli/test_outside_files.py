"""Every reader of a file from outside: what is none of its kind is refused soon, in one line, in little memory."""

from __future__ import annotations

import contextlib
import io
import os
import resource
import shutil
import time
import zipfile
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
import torch
import zstandard
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.writer import MCAP0_MAGIC

from fulmar_bags.contents import open_bag
from fulmar_bags.event_files import open_event_file
from fulmar_bags.recovery import recover
from fulmar_core.config.errors import FulmarError
from fulmar_core.estimators.kinds import load_estimator
from fulmar_core.loop.bundle_signature import verify_bundle
from fulmar_core.loop.policy_bundle import GOLDEN, NETWORK, PASSPORT, SIGNATURE, read_bundle
from fulmar_core.robots.calibration import load_calibration
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.robots.sensors import catalogue
from fulmar_core.tasks import load_task
from fulmar_core.tasks.goal_files import load_goals
from hardware_drivers.hardware import load_hardware
from policy_server.controllers import shipped_policies
from policy_server.policy import Policy
from training.foreign_checkpoint import read_checkpoint
from training.foreign_onnx import ForeignOnnx

MOST_S, MOST_KB = 2.0, 500_000
REPLAY = Path(__file__).parent.parent / "replay" / "bags" / "floating_platform_go_to_pose_lqr"
EVENTS = Path(__file__).parent.parent / "fulmar_bags" / "event_files" / "stars.aedat4"
BUNDLE = shipped_policies()[0]

Read = Callable[[Path], object]


def of_a_bundle(name: str) -> Read:
    """Reads a bundle of which one file is the given one."""

    def read(path: Path) -> object:
        folder = path.with_name(f"bundle_with_{name}")
        shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(BUNDLE, folder)
        (folder / name).unlink(missing_ok=True)
        (folder / name).symlink_to(path)
        bundle = read_bundle(folder)
        if name == SIGNATURE:
            key = path.with_name("key.pem")
            key.write_text(PUBLIC_KEY)
            return verify_bundle(bundle, key)
        if name == NETWORK:
            robot, task = load_robot(bundle.passport.robot), load_task(bundle.passport.task)
            return Policy(folder, robot, task, control_hz=bundle.passport.control_hz)
        return bundle.golden()

    return read


PUBLIC_KEY = """-----BEGIN PUBLIC KEY-----
MCowBQYDK2VwAyEAGb9ECWmEzf6FQbrBZ9w7lshQhqowtrbLDFw4rXAxZuE=
-----END PUBLIC KEY-----
"""


def named_as(ending: str, read: Read) -> Read:
    """Reads the file under a name with another ending."""

    def renamed(path: Path) -> object:
        name = path.with_name(f"named{ending}")
        name.unlink(missing_ok=True)
        name.symlink_to(path)
        return read(name)

    return renamed


def bag_with_metadata(path: Path) -> object:
    """Opens a sound bag with the file as its `metadata.yaml`; it is left out with a warning where it cannot be read."""
    folder = path.with_name("bag")
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(REPLAY, folder)
    (folder / "metadata.yaml").unlink()
    (folder / "metadata.yaml").symlink_to(path)
    return open_bag(folder)


def stars(path: Path) -> object:
    """Loads the file as the catalogue of stars."""
    original = catalogue.catalogue_path
    catalogue.load_stars.cache_clear()
    try:
        catalogue.catalogue_path = lambda: path
        return catalogue.load_stars()
    finally:
        catalogue.catalogue_path = original
        catalogue.load_stars.cache_clear()


def every_packet(path: Path) -> object:
    """Reads a recording of an event camera to its end."""
    return sum(1 for _ in open_event_file(path, (640, 480) if path.suffix == ".h5" else None).packets(0.1))


def recovered(path: Path) -> object:
    """Recovers a bag folder that has the file."""
    folder = path.with_name("torn")
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    (folder / "torn_0.mcap").symlink_to(path)
    return recover(folder)


READERS: dict[str, Read] = {
    "robot": named_as(".yaml", lambda path: load_robot(str(path))),
    "goals": named_as(".yaml", lambda path: load_goals(str(path))),
    "estimator": named_as(".yaml", lambda path: load_estimator(str(path))),
    "hardware": named_as(".yaml", lambda path: load_hardware(str(path))),
    "calibration": named_as(".yaml", load_calibration),
    "key": lambda path: verify_bundle(read_bundle(BUNDLE), path),
    "signature": of_a_bundle(SIGNATURE),
    "passport": of_a_bundle(PASSPORT),
    "network": of_a_bundle(NETWORK),
    "golden": of_a_bundle(GOLDEN),
    "mcap": named_as(".mcap", open_bag),
    "mcap_packed": named_as(".mcap.zstd", open_bag),
    "sqlite3": named_as(".db3", open_bag),
    "sqlite3_packed": named_as(".db3.zstd", open_bag),
    "metadata": bag_with_metadata,
    "recover": recovered,
    "dsec": named_as(".h5", every_packet),
    "aedat4": named_as(".aedat4", every_packet),
    "stars": stars,
    "checkpoint": read_checkpoint,
    "onnx": ForeignOnnx,
}
# A bag is read without its metadata, and as far as its files are sound.
TOLERANT = {
    ("metadata", ""),
    ("mcap", "ten_gigabytes_that_begin_well"),
    ("recover", "ten_gigabytes_that_begin_well"),
}


def refusal(reader: str, make: Callable[[Path], None]) -> contextlib.AbstractContextManager[object]:
    """What is expected of a reader that is given a harmful file."""
    tolerant = (reader, "") in TOLERANT or (reader, make.__name__) in TOLERANT
    return contextlib.nullcontext() if tolerant else pytest.raises(FulmarError)


@contextlib.contextmanager
def within_bounds() -> object:
    """Fail where reading takes long, takes much memory, or raises other than in one line."""
    before_kb, began_s = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, time.process_time()
    try:
        yield
    except FulmarError as error:
        assert len(str(error).splitlines()) == 1, error
    assert time.process_time() - began_s < MOST_S
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before_kb < MOST_KB


def a_pipe(path: Path) -> None:
    os.mkfifo(path)


def a_device(path: Path) -> None:
    path.symlink_to("/dev/zero")


def ten_gigabytes(path: Path) -> None:
    with path.open("wb") as file:
        file.truncate(10_000_000_000)


def ten_gigabytes_that_begin_well(path: Path) -> None:
    with path.open("wb") as file:
        file.write(MCAP0_MAGIC)
        file.truncate(10_000_000_000)


def a_packed_bomb(path: Path) -> None:
    """A megabyte that unpacks to eight gigabytes, and begins as a bag does."""
    packer = zstandard.ZstdCompressor(level=3).compressobj()
    with path.open("wb") as file:
        file.write(packer.compress(MCAP0_MAGIC))
        zeros = bytes(1 << 24)
        for _ in range(512):
            file.write(packer.compress(zeros))
        file.write(packer.flush())


def a_zipped_bomb(path: Path) -> None:
    """A megabyte whose arrays have a gigabyte."""
    with (
        zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive,
        archive.open("star_table.npy", "w") as file,
    ):
        head = io.BytesIO()
        np.lib.format.write_array_header_2_0(
            head, {"descr": "<f8", "fortran_order": False, "shape": (1 << 27,)}
        )
        file.write(head.getvalue())
        for _ in range(64):
            file.write(bytes(1 << 24))


def an_expanded_tensor(path: Path) -> None:
    """A kilobyte that stands for forty gigabytes of weights."""
    weight = torch.zeros(1).expand(100_000, 100_000)
    torch.save({"policy": {"net.weight": weight, "net.bias": torch.zeros(100_000)}}, path)


def an_endless_recording(path: Path) -> None:
    """A kilobyte that stands for a trillion events."""
    with h5py.File(path, "w") as file:
        for name in "xytp":
            file.create_dataset(f"events/{name}", shape=(10**12,), dtype="u4", chunks=(1 << 20,))


HARMFUL = (
    a_pipe,
    a_device,
    ten_gigabytes,
    ten_gigabytes_that_begin_well,
    an_expanded_tensor,
    an_endless_recording,
)
BOMBS = (a_packed_bomb, a_zipped_bomb)


@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize("make", HARMFUL, ids=lambda make: make.__name__)
def test_a_harmful_file_is_refused_in_one_line(
    reader: str, make: Callable[[Path], None], tmp_path: Path
) -> None:
    make(tmp_path / "file")
    with refusal(reader, make), within_bounds_of_errors():
        READERS[reader](tmp_path / "file")


@contextlib.contextmanager
def within_bounds_of_errors() -> object:
    """As `within_bounds`, and raises what was raised."""
    raised: list[FulmarError] = []
    with within_bounds():
        try:
            yield
        except FulmarError as error:
            raised.append(error)
            raise
    if raised:
        raise raised[0]


@pytest.fixture(scope="module")
def bombs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a file of each kind that unpacks to gigabytes."""
    folder = tmp_path_factory.mktemp("bombs")
    for make in BOMBS:
        make(folder / make.__name__)
    return folder


@pytest.mark.slow
@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize("make", BOMBS, ids=lambda make: make.__name__)
def test_a_file_that_unpacks_to_gigabytes_is_refused_in_one_line(
    reader: str, make: Callable[[Path], None], bombs: Path, tmp_path: Path
) -> None:
    shutil.copy(bombs / make.__name__, tmp_path / "file")
    with refusal(reader, make), within_bounds_of_errors():
        READERS[reader](tmp_path / "file")


SOUND: dict[str, Path] = {
    "passport": BUNDLE / PASSPORT,
    "network": BUNDLE / NETWORK,
    "golden": BUNDLE / GOLDEN,
    "mcap": next(REPLAY.glob("*.mcap")),
    "recover": next(REPLAY.glob("*.mcap")),
    "metadata": REPLAY / "metadata.yaml",
    "aedat4": EVENTS,
}


def spoilt(content: bytes, cut: float, flips: list[tuple[float, int]]) -> bytes:
    """The first part of a file, with some bytes exchanged."""
    data = bytearray(content[: round(cut * len(content))])
    for place, value in flips:
        if data:
            data[round(place * (len(data) - 1))] = value
    return bytes(data)


SHARES = st.floats(0.0, 1.0)
SPOILS = st.tuples(SHARES, st.lists(st.tuples(SHARES, st.integers(0, 255)), max_size=6))


def read_without_traceback(reader: str, content: bytes, folder: Path) -> None:
    (folder / "file").write_bytes(content)
    with within_bounds():
        READERS[reader](folder / "file")


QUICK = settings(max_examples=8, deadline=None, suppress_health_check=list(HealthCheck))
THOROUGH = settings(max_examples=1000, deadline=None, suppress_health_check=list(HealthCheck))


@pytest.mark.parametrize("reader", READERS)
def test_random_bytes_end_in_no_traceback(reader: str, tmp_path: Path) -> None:
    QUICK(given(st.binary(max_size=400))(lambda data: read_without_traceback(reader, data, tmp_path)))()


@pytest.mark.parametrize("reader", SOUND)
def test_damaged_files_end_in_no_traceback(reader: str, tmp_path: Path) -> None:
    content = SOUND[reader].read_bytes()
    QUICK(given(SPOILS)(lambda how: read_without_traceback(reader, spoilt(content, *how), tmp_path)))()


@pytest.mark.slow
@pytest.mark.parametrize("reader", READERS)
def test_many_random_bytes_end_in_no_traceback(reader: str, tmp_path: Path) -> None:
    THOROUGH(given(st.binary(max_size=4_000))(lambda data: read_without_traceback(reader, data, tmp_path)))()


@pytest.mark.slow
@pytest.mark.parametrize("reader", SOUND)
def test_many_damaged_files_end_in_no_traceback(reader: str, tmp_path: Path) -> None:
    content = SOUND[reader].read_bytes()
    THOROUGH(given(SPOILS)(lambda how: read_without_traceback(reader, spoilt(content, *how), tmp_path)))()
