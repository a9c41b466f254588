"""A policy with its passport: whatever was touched is refused."""

from __future__ import annotations

import errno
import json
import pickle
from dataclasses import replace

import numpy as np
import pytest

from fulmar_core.config.errors import BundleError
from fulmar_core.controllers.disturbance_inputs import disturbance_terms
from fulmar_core.loop import policy_bundle
from fulmar_core.loop.policy_bundle import (
    FORMAT,
    GOLDEN,
    NETWORK,
    PASSPORT,
    Golden,
    Passport,
    check_fit,
    read_golden,
    read_passport,
    takes_disturbances,
    write_bundle,
)
from fulmar_core.robots.robot_file import load_robot
from fulmar_core.tasks import load_task

ROBOT, TASK = load_robot("floating_platform"), load_task("go_to_pose")
NONE = np.zeros((2, 0), np.float32)
VECTORS = Golden(
    np.ones((2, 10), np.float32), NONE, np.zeros((2, 8), np.float32), np.full((2, 8), 0.5, np.float32), NONE
)
BLANK = Passport(
    FORMAT,
    ROBOT.name,
    TASK.name,
    5.0,
    TASK.observation_names,
    ROBOT.actuators.names,
    "on_off",
    (1.0,) * 8,
    0,
    "",
    "",
    {"seed": 1, "best": {"a": 0.5}},
)


@pytest.fixture
def folder(tmp_path):
    write_bundle(tmp_path / "bundle", b"not really a network", VECTORS, BLANK)
    return tmp_path / "bundle"


def reseal(folder, **changes):
    """What a forger would do: change the passport and compute its hash anew."""
    values = json.loads((folder / PASSPORT).read_text()) | changes
    del values["sha256"]
    blank = Passport(**values)
    (folder / PASSPORT).write_text(json.dumps({**values, "sha256": blank.expected_sha256()}))


def test_what_was_written_is_what_is_read(folder):
    passport = read_passport(folder)
    assert replace(passport, network_sha256="", golden_sha256="", sha256="") == BLANK
    golden = read_golden(folder)
    for name in ("observations", "commands", "logits"):
        np.testing.assert_array_equal(getattr(golden, name), getattr(VECTORS, name))


def test_writing_twice_gives_the_same_hash(folder, tmp_path):
    again = write_bundle(tmp_path / "again", b"not really a network", VECTORS, BLANK)
    assert again.network_sha256 == read_passport(folder).network_sha256
    assert write_bundle(tmp_path / "other", b"another network", VECTORS, BLANK).sha256 != again.sha256


def test_a_bundle_that_cannot_be_replaced_stays_as_it_was(folder, monkeypatch):
    def full(file):
        raise OSError(errno.ENOSPC, "No space left on device")

    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    monkeypatch.setattr("fulmar_core.config.atomic_write._settle", full)
    with pytest.raises(OSError, match="No space left"):
        write_bundle(folder, b"another network", VECTORS, BLANK)
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


@pytest.mark.parametrize("name", [PASSPORT, NETWORK, GOLDEN])
def test_a_missing_file_is_named(folder, name):
    (folder / name).unlink()
    with pytest.raises(BundleError, match=f"has no {name}. Export one"):
        read_passport(folder)


@pytest.mark.parametrize("name", [NETWORK, GOLDEN])
def test_one_flipped_bit_in_a_file_is_noticed(folder, name):
    content = bytearray((folder / name).read_bytes())
    content[len(content) // 2] ^= 1
    (folder / name).write_bytes(content)
    with pytest.raises(BundleError, match=f"{name}: SHA-256 is .*, the passport says"):
        read_passport(folder)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("robot", "other"),
        ("task", "other"),
        ("control_hz", 10.0),
        ("observation_names", ["a"]),
        ("actuator_names", ["a"]),
        ("network_sha256", "0" * 64),
        ("golden_sha256", "0" * 64),
        ("training", {}),
        ("sha256", "0" * 64),
    ],
)
def test_every_change_of_the_passport_is_noticed(folder, key, value):
    values = json.loads((folder / PASSPORT).read_text())
    (folder / PASSPORT).write_text(json.dumps(values | {key: value}))
    with pytest.raises(BundleError, match="was changed after export"):
        read_passport(folder)


def test_an_unknown_key_gets_the_nearest_one(folder):
    values = json.loads((folder / PASSPORT).read_text())
    (folder / PASSPORT).write_text(json.dumps(values | {"robt": "x"}))
    with pytest.raises(BundleError, match=r"unknown key 'robt'\. Did you mean 'robot'\?$"):
        read_passport(folder)


@pytest.mark.parametrize("key", list(BLANK.plain()))
def test_a_missing_key_is_named(folder, key):
    values = json.loads((folder / PASSPORT).read_text())
    del values[key]
    (folder / PASSPORT).write_text(json.dumps(values))
    with pytest.raises(BundleError, match=f"lacks the key '{key}'"):
        read_passport(folder)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("control_hz", "5"),
        ("control_hz", None),
        ("control_hz", True),
        ("robot", 3),
        ("observation_names", "goal"),
        ("training", [1]),
        ("format", "1"),
        ("network_sha256", None),
    ],
)
def test_a_value_of_the_wrong_type_is_refused_even_when_sealed(folder, key, value):
    reseal(folder, **{key: value})
    with pytest.raises(BundleError, match=f"'{key}' is .*of the wrong type"):
        read_passport(folder)


@pytest.mark.parametrize("content", [b"", b"{", b"\xff\xfe", b"[" * 100_000])
def test_a_passport_that_is_no_json_is_refused(folder, content):
    (folder / PASSPORT).write_bytes(content)
    with pytest.raises(BundleError, match=r"passport\.json: cannot be read"):
        read_passport(folder)


@pytest.mark.parametrize("content", ["[]", "1", "null", '"x"'])
def test_a_passport_that_is_no_object_is_refused(folder, content):
    (folder / PASSPORT).write_text(content)
    with pytest.raises(BundleError, match="must hold one JSON object"):
        read_passport(folder)


def test_another_format_is_refused(folder):
    reseal(folder, format=FORMAT + 1)
    with pytest.raises(BundleError, match=f"has format {FORMAT + 1}, this Fulmar reads {FORMAT}"):
        read_passport(folder)


def test_a_passport_of_an_older_format_is_reported_as_one_and_not_by_what_it_lacks(folder):
    (folder / PASSPORT).write_text('{"format": 1, "robot": "floating_platform"}')
    with pytest.raises(BundleError, match=f"has format 1, this Fulmar reads {FORMAT}"):
        read_passport(folder)


@pytest.mark.parametrize("name", [PASSPORT, NETWORK, GOLDEN])
def test_a_file_beyond_the_size_limit_is_not_read(folder, name, monkeypatch):
    monkeypatch.setattr(policy_bundle, "MAX_BYTES", 10_000)
    (folder / name).write_bytes(b"0" * 10_001)
    with pytest.raises(BundleError, match=f"{name}: cannot be read: 10001 bytes, at most 10000"):
        read_passport(folder)


def test_golden_vectors_never_unpickle_anything(folder):
    class Bomb:
        def __reduce__(self):
            return (pytest.fail, ("unpickled",))

    with (folder / GOLDEN).open("wb") as file:
        np.savez(
            file,
            observations=np.array([Bomb()], dtype=object),
            commands=VECTORS.commands,
            logits=VECTORS.logits,
        )
    with pytest.raises(BundleError, match=r"golden\.npz: cannot be read"):
        read_golden(folder)
    (folder / GOLDEN).write_bytes(pickle.dumps({"a": 1}))
    with pytest.raises(BundleError, match=r"golden\.npz: cannot be read"):
        read_golden(folder)


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 torn", b"nonsense"])
def test_golden_vectors_that_are_no_archive_are_refused(folder, content):
    (folder / GOLDEN).write_bytes(content)
    with pytest.raises(BundleError, match=r"golden\.npz: cannot be read"):
        read_golden(folder)


def test_golden_vectors_that_lack_an_array_are_refused(folder):
    with (folder / GOLDEN).open("wb") as file:
        np.savez(file, observations=VECTORS.observations)
    with pytest.raises(BundleError, match="memories"):
        read_golden(folder)


def test_a_passport_that_fits_is_accepted():
    check_fit(BLANK, ROBOT, TASK, 5.0, where="here")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"robot": "boat"}, "policy 'here' was trained for robot 'boat', not 'floating_platform'"),
        ({"task": "go_to_position"}, "was trained for task 'go_to_position', not 'go_to_pose'"),
        ({"control_hz": 10.0}, "was trained at 10 Hz, but would run at 5 Hz"),
        ({"control_hz": float("nan")}, "was trained at nan Hz, but would run at 5 Hz"),
        ({"observation_names": TASK.observation_names[:-1]}, "has 9 observation names, 10 are needed"),
        ({"observation_names": TASK.observation_names[::-1]}, "observation 1 is 'goal_distance', it must be"),
        ({"actuator_names": ROBOT.actuators.names[:-1]}, "has 7 actuator names, 8 are needed"),
        ({"action": "continuous"}, "gives continuous commands, 'floating_platform' takes on_off"),
        ({"command_scale": (2.0,) * 8}, "was trained for full commands of [2.0, 2.0"),
        ({"actuator_names": ("a", *ROBOT.actuators.names[1:])}, "actuator 1 is 'a', it must be 'thruster_1'"),
    ],
)
def test_a_passport_made_for_something_else_is_refused(change, words):
    with pytest.raises(BundleError) as caught:
        check_fit(replace(BLANK, **change), ROBOT, TASK, 5.0, where="here")
    assert words in str(caught.value)


NAMES, TERMS = TASK.observation_names, disturbance_terms(ROBOT)


def test_disturbances_that_a_passport_names_behind_the_observation_are_taken():
    passport = replace(BLANK, observation_names=NAMES + TERMS)
    check_fit(passport, ROBOT, TASK, 5.0, where="here")
    assert takes_disturbances(passport.observation_names, ROBOT)
    assert not takes_disturbances(BLANK.observation_names, ROBOT)


@pytest.mark.parametrize(
    ("names", "words"),
    [
        (
            NAMES + TERMS[:-1],
            f"has {len(NAMES + TERMS) - 1} observation names, {len(NAMES + TERMS)} are needed",
        ),
        (NAMES + TERMS[::-1], f"observation {len(NAMES) + 1} is '{TERMS[-1]}', it must be '{TERMS[0]}'"),
        (TERMS + NAMES, f"observation 1 is '{TERMS[0]}', it must be '{NAMES[0]}'"),
        # As many inputs as there would be with disturbances, by other names: never recognised by their number.
        (
            NAMES + tuple(f"other_{i}" for i in range(len(TERMS))),
            f"has {len(NAMES + TERMS)} observation names, {len(NAMES)} are needed",
        ),
    ],
)
def test_a_passport_with_other_inputs_than_observation_and_disturbances_is_refused(names, words):
    with pytest.raises(BundleError) as caught:
        check_fit(replace(BLANK, observation_names=names), ROBOT, TASK, 5.0, where="here")
    assert words in str(caught.value)


def test_a_robot_without_valves_has_no_disturbances_to_name():
    boat = load_robot("kingfisher")
    assert disturbance_terms(boat) == ()
    assert not takes_disturbances((*NAMES, "push_torque"), boat)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"action": "jump"}, "'action' or 'memory' has no meaning"),
        ({"memory": -1}, "'action' or 'memory' has no meaning"),
        ({"command_scale": ["much"]}, "'command_scale' must hold numbers"),
    ],
)
def test_a_passport_with_a_value_of_no_meaning_is_refused(folder, changes, words):
    values = json.loads((folder / PASSPORT).read_text()) | changes
    (folder / PASSPORT).write_text(json.dumps(values))
    with pytest.raises(BundleError, match=words):
        read_passport(folder)
