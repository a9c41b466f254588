"""`make with EXTRA=...` adds an extra and what it needs, each in the version and with the hashes of the lock."""

from __future__ import annotations

import tomllib
from importlib.metadata import PackageNotFoundError
from pathlib import Path
from types import SimpleNamespace

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from fulmar_cli.installation import add_extra
from fulmar_cli.installation.add_extra import add, pins_of
from fulmar_core.config.errors import ConfigError, UnknownNameError

REPOSITORY = Path(__file__).parents[2]
ASKED = {
    "fulmar": [
        "numpy>=1",
        "glider>=1; extra == 'gliders'",
        "Never; sys_platform == 'cp/m' and extra == 'gliders'",
    ],
    "numpy": [],
    "glider": ["wing[foil]>=2", "numpy", "tail; extra == 'tails'"],
    "wing": ["glue; extra == 'foil'", "glider"],  # in a circle
    "glue": [],
}
LOCK = "\n".join(
    f"{pin} ; sys_platform == 'linux' \\\n    --hash=sha256:{'0' * 64}"
    for pin in ("glider==1.2", "glue==3.0", "numpy==2.0", "tail==1.0", "wing[foil]==2.5")
)


@pytest.fixture
def pip(monkeypatch):
    """Packages that are here, by version, and what pip was given, a list for each call."""
    here, calls = {"numpy": "2.0"}, []

    def install(pins):
        calls.append(pins)
        here.update(add_extra.PIN.match(pin).groups() for pin in pins)

    def version(name):
        if name not in here:
            raise PackageNotFoundError(name)
        return here[name]

    monkeypatch.setattr(add_extra, "requires", lambda name: ASKED[name])
    monkeypatch.setattr(add_extra, "version", version)
    monkeypatch.setattr(add_extra, "_install", install)
    return here, calls


def test_an_extra_comes_with_what_it_needs_in_the_versions_of_the_lock(pip):
    here, calls = pip
    assert add(["gliders"], pins_of(LOCK)) == ["glider", "wing", "glue"]
    assert here == {"numpy": "2.0", "glider": "1.2", "wing": "2.5", "glue": "3.0"}
    assert all("--hash=sha256:" in pin for call in calls for pin in call)
    assert add(["gliders"], pins_of(LOCK)) == []
    assert len(calls) == 3


def test_pip_installs_what_has_the_hashes_of_the_lock_and_nothing_else(monkeypatch):
    asked = []

    def run(command, check):
        lock = Path(command[command.index("-r") + 1]).read_text(encoding="utf-8")
        asked.append((command, lock))
        return SimpleNamespace(returncode=0)

    monkeypatch.setattr(add_extra.subprocess, "run", run)
    pin = pins_of(LOCK)["glider"]
    add_extra._install([pin])
    ((command, lock),) = asked
    assert {"--require-hashes", "--no-deps"} <= {*command}
    assert lock == f"{pin}\n"


def test_another_version_than_that_of_the_lock_is_replaced(pip):
    here, _ = pip
    here["glider"] = "1.1"
    assert add(["gliders"], pins_of(LOCK))[0] == "glider"
    assert here["glider"] == "1.2"


def test_what_the_lock_lacks_is_named(pip):
    with pytest.raises(ConfigError, match=r"requirements-dev\.lock has no glue\. Make it anew: make lock"):
        add(["gliders"], {name: pin for name, pin in pins_of(LOCK).items() if name != "glue"})


def test_a_wrong_extra_gets_the_nearest_and_none_gets_all(pip):
    with pytest.raises(UnknownNameError, match="Did you mean 'gliders'"):
        add(["glider"], pins_of(LOCK))
    with pytest.raises(ConfigError, match=r"make with EXTRA=jsbsim\. Known: gliders\."):
        add([], pins_of(LOCK))


def test_the_lock_of_this_checkout_pins_every_extra_by_hash_and_without_an_address():
    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["project"]
    pins = pins_of((REPOSITORY / add_extra.LOCK).read_text())
    for extra, texts in project["optional-dependencies"].items():
        for one in map(Requirement, texts):
            if one.name != "fulmar":
                pin = pins[canonicalize_name(one.name)]
                assert "--hash=sha256:" in pin, extra
                assert "://" not in pin
