"""Lock files: exact, hashed, without addresses, consistent with pyproject.toml and each other."""

from __future__ import annotations

import re
import tomllib
from importlib.metadata import PackageNotFoundError, requires

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from packaging.version import Version

from fulmar_cli.installation.installed_as import EXTRAS_OF_SETUP
from training.dreamer_process import SHEEPRL

RUN_LOCK, DEV_LOCK, PEERS_LOCK = "requirements.lock", "requirements-dev.lock", "requirements-peers.lock"
DREAMER_LOCK, DOCS_LOCK = "requirements-dreamer.lock", "requirements-docs.lock"
LOCKS = [RUN_LOCK, DEV_LOCK, PEERS_LOCK, DREAMER_LOCK, DOCS_LOCK]
PYTHONS = ["3.11", "3.12", "3.13", "3.14"]
RUN_EXTRAS = ["ros", "sim", "policy", "bags", "hardware", "view", "console"]
DEV_EXTRAS = [
    "events",
    "jsbsim",
    "datasets",
    "gym",
    "train",
    "cluster",
    "pettingzoo",
    "wandb",
    "video",
    "foxglove",
    "rerun",
]
INSTALLED = [
    (RUN_LOCK, RUN_EXTRAS, ["build"]),
    (DEV_LOCK, [*RUN_EXTRAS, *DEV_EXTRAS], ["build", "dev"]),
    (PEERS_LOCK, None, ["peers"]),
    (DREAMER_LOCK, None, ["dreamer"]),
    (DOCS_LOCK, None, ["docs"]),
]


def entries(text):
    """Each requirement of a lock with its hashes: (requirement, [hash, ...])."""
    for entry in re.split(r"(?<!\\)\n", text):
        pin, *hashes = re.split(r"\\\n\s+--hash=", entry)
        if pin.strip() and not pin.startswith("#"):
            yield Requirement(pin.strip()), hashes


def machine(python):
    """Linux on x86-64 with one Python, for the markers of requirements."""
    return {
        "python_version": python,
        "python_full_version": f"{python}.0",
        "sys_platform": "linux",
        "platform_system": "Linux",
        "platform_machine": "x86_64",
        "implementation_name": "cpython",
        "platform_python_implementation": "CPython",
    }


def versions(text, python):
    """What a lock installs on Linux x86-64 with one Python: {name: version}."""
    return {
        canonicalize_name(requirement.name): str(requirement.specifier).removeprefix("==")
        for requirement, _ in entries(text)
        if requirement.marker is None or requirement.marker.evaluate(machine(python))
    }


@pytest.fixture(scope="module")
def project(repository):
    return tomllib.loads((repository / "pyproject.toml").read_text())


@pytest.fixture(scope="module")
def locks(repository):
    return {name: (repository / name).read_text() for name in LOCKS}


def wanted(project, extras, groups, python):
    """Requirements of some extras and groups with one Python; extras None: without Fulmar itself."""
    texts = [] if extras is None else [*project["project"]["dependencies"]]
    for extra in extras or ():
        texts += project["project"]["optional-dependencies"][extra]
    for group in groups:
        texts += [text for text in project["dependency-groups"][group] if isinstance(text, str)]
    requirements = map(Requirement, texts)
    return [one for one in requirements if one.marker is None or one.marker.evaluate(machine(python))]


@pytest.mark.parametrize("name", LOCKS)
def test_a_lock_has_no_address_and_no_path(locks, name):
    for forbidden in (
        r"://",
        r"\bwww\.",
        r"\.(org|com|io|net|dev)\b",
        r"--(index|extra-index|find-links)",
        r"\s@\s",
    ):
        assert re.search(forbidden, locks[name]) is None, forbidden
    assert re.search(r"(^|\s)[./~]*/\w", locks[name]) is None


@pytest.mark.parametrize("name", LOCKS)
def test_every_pin_is_exact_and_hashed(locks, name):
    pins = list(entries(locks[name]))
    assert len(pins) > (10 if name == DOCS_LOCK else 50)
    for requirement, hashes in pins:
        assert requirement.url is None
        assert re.fullmatch(r"==[^*,]+", str(requirement.specifier)), requirement
        assert hashes, requirement
        assert all(re.fullmatch(r"sha256:[0-9a-f]{64}", digest.strip()) for digest in hashes), requirement


@pytest.mark.parametrize(("name", "extras", "groups"), INSTALLED[:2])
def test_a_pin_has_every_required_extra(project, locks, name, extras, groups):
    """Without it, pip before 23.3 selects the newest version of the extra, and then lacks its hash."""
    pinned = {canonicalize_name(requirement.name): requirement for requirement, _ in entries(locks[name])}
    all_wanted = wanted(project, extras, groups, "3.11") + [
        one for requirement in pinned.values() for one in wanted_by(requirement)
    ]
    with_extras = [one for one in all_wanted if one.extras]
    assert with_extras
    for one in with_extras:
        assert one.extras <= pinned[canonicalize_name(one.name)].extras, f"{one}. Run `make lock`."


def wanted_by(requirement):
    """Requirements of an installed package with its pinned extras; empty if it is not installed."""
    try:
        texts = requires(requirement.name) or []
    except PackageNotFoundError:
        return
    for one in map(Requirement, texts):
        if one.marker is None or any(
            one.marker.evaluate({"extra": extra}) for extra in ("", *requirement.extras)
        ):
            yield one


@pytest.mark.parametrize("python", PYTHONS)
@pytest.mark.parametrize(("name", "extras", "groups"), INSTALLED)
def test_the_pins_satisfy_pyproject(project, locks, name, extras, groups, python):
    pinned = versions(locks[name], python)
    for requirement in wanted(project, extras, groups, python):
        version = pinned.get(canonicalize_name(requirement.name))
        assert version is not None, f"{requirement.name} is not in {name}. Run `make lock`."
        assert requirement.specifier.contains(version, prereleases=True), (
            f"{requirement}, but {version}. Run `make lock`."
        )


def test_the_locks_have_every_extra(project):
    assert set(project["project"]["optional-dependencies"]) == {*RUN_EXTRAS, *DEV_EXTRAS, "run"}


def test_the_extra_run_is_what_the_run_time_lock_has(project):
    assert project["project"]["optional-dependencies"]["run"] == [f"fulmar[{','.join(RUN_EXTRAS)}]"]
    assert tuple(RUN_EXTRAS) == EXTRAS_OF_SETUP


def test_the_run_time_lock_can_build_the_editable_installation(project, locks):
    pinned = versions(locks[RUN_LOCK], "3.11")
    for text in project["build-system"]["requires"]:
        requirement = Requirement(text)
        assert requirement.specifier.contains(pinned[requirement.name])


@pytest.mark.parametrize("python", PYTHONS)
def test_running_needs_no_learning_library(locks, python):
    pinned = versions(locks[RUN_LOCK], python)
    heavy = {"torch", "triton", "stable-baselines3", "gymnasium"}
    assert not [name for name in pinned if name in heavy or name.startswith("nvidia-")]


@pytest.mark.parametrize("python", PYTHONS)
def test_the_development_lock_contains_the_run_time_lock(locks, python):
    # One .venv serves both: `make setup` must never move what `make dev` installed.
    run, dev = versions(locks[RUN_LOCK], python), versions(locks[DEV_LOCK], python)
    assert {name: dev.get(name) for name in run} == run


@pytest.mark.parametrize("python", PYTHONS)
def test_the_peers_may_contradict_our_own_lock_and_bring_a_pip_that_can_install_them(locks, python):
    peers, dev = versions(locks[PEERS_LOCK], python), versions(locks[DEV_LOCK], python)
    # As soon as they agree, one environment is enough.
    assert peers["torch"] != dev["torch"]
    assert Version(peers["pip"]) >= Version("23.3")
    assert "fulmar" not in peers


@pytest.mark.parametrize("python", PYTHONS)
def test_dreamer_learns_with_our_torch_and_contradicts_our_lock_in_pillow_alone(locks, python):
    dreamer, dev = versions(locks[DREAMER_LOCK], python), versions(locks[DEV_LOCK], python)
    # As soon as they agree, one environment is enough.
    assert {name for name in dreamer.keys() & dev.keys() if dreamer[name] != dev[name]} == {"pillow"}
    assert dreamer["sheeprl"] == SHEEPRL
    assert "fulmar" not in dreamer
