"""No text from outside means more than itself in a unit, a rule of udev, a launch or a layout: hypothesis tries."""

from __future__ import annotations

import json
import shlex
import shutil
from dataclasses import replace
from pathlib import Path

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from fulmar_bringup.launched_system import list_nodes
from fulmar_bringup.layouts.layout_file import PROGRAMS, layout_text
from fulmar_bringup.service.device_rules import device_rules
from fulmar_bringup.service.unit import PASSED, Service, command_of, unit_text
from fulmar_core.config.errors import ConfigError
from fulmar_core.config.written_text import LINE, NAME, USER, check_written
from hardware_drivers.hardware import load_hardware
from policy_server.controllers import shipped_policy

SERVICE = Service("a", "mujoco_lqr", ("/bin/fulmar", "up"), "games")
HARMLESS = unit_text(SERVICE, {})
BREAKS = ("\n", "\r", "\x00", "\x1b[2J", "\x0b", "\x85", "\u2028", "\u202e")
ODD = ('"', "'", ";", "$", "%", "*", "[", "?", " ", "../", "/", "\\", "=", "#", ",", "\t", "{", "@", "!")
PIECES = st.sampled_from([*BREAKS, *ODD, "0", "root", "ExecStart=/bin/sh", "a", "é"])
TEXTS = st.lists(PIECES | st.text(max_size=6), min_size=1, max_size=8).map("".join)
FIELDS = {"name": NAME, "system": NAME, "user": USER}


def is_of(text: str, kind: str) -> bool:
    try:
        check_written("x", text, kind)
    except ConfigError:
        return False
    return True


@given(st.sampled_from(list(FIELDS)), TEXTS)
def test_a_field_of_a_unit_is_a_name_or_refused_by_its_own(field, text):
    service = replace(SERVICE, **{field: text})
    if not is_of(text, FIELDS[field]):
        with pytest.raises(ConfigError, match=f"^{field} = "):
            unit_text(service, {})
        return
    assert text.isascii()
    assert "/" not in text
    assert len(unit_text(service, {}).splitlines()) == len(HARMLESS.splitlines())


@given(TEXTS, st.sampled_from(PASSED))
def test_a_variable_is_one_line_that_systemd_reads_as_it_was_or_refused_by_its_name(text, name):
    if not is_of(text, LINE):
        with pytest.raises(ConfigError, match=f"^{name} = "):
            unit_text(SERVICE, {name: text})
        return
    lines = set(unit_text(SERVICE, {name: text}).split("\n")) - set(HARMLESS.split("\n"))
    if not text:  # counts as not set
        assert not lines
        return
    (line,) = lines
    quoted = line.removeprefix("Environment=").replace("%%", "%")
    assert read_by_systemd(quoted) == [f"{name}={text}"]


@given(TEXTS)
def test_a_word_of_the_command_stays_one_word_or_is_refused(text):
    service = replace(SERVICE, command=("/bin/fulmar", "--policy", text, "end"))
    if not is_of(text, LINE):
        with pytest.raises(ConfigError, match=r"^command = "):
            unit_text(service, {})
        return
    unit = unit_text(service, {})
    assert command_of(unit) == service.command
    (line,) = [line for line in unit.split("\n") if line.startswith("ExecStart=")]
    words = read_by_systemd(line.removeprefix("ExecStart=").replace("%%", "%").replace("$$", "$"))
    assert words == list(service.command)


def read_by_systemd(line: str) -> list[str]:
    """Words of a line by the rules of systemd.syntax that our quoting uses: those of a POSIX shell's double quotes."""
    lexer = shlex.shlex(line, posix=True, punctuation_chars=False)
    lexer.whitespace_split, lexer.commenters, lexer.quotes = True, "", '"'
    lexer.whitespace, lexer.escape = " ", "\\"
    return list(lexer)


@given(TEXTS)
def test_a_port_is_one_device_or_no_rule_or_refused_by_its_key(text):
    """`*`, quotes and commas would make a rule of other devices, and root runs what a rule says."""
    hardware = load_hardware("turtlebot2")
    hardware = replace(hardware, driver=replace(hardware.driver, port=f"/dev/{text}"))
    device = text.partition(",")[0]
    try:
        rules = device_rules(hardware)
    except ConfigError as error:
        assert str(error).startswith("port = ")
        return
    assert all(is_of(part, NAME) and part not in ("", "..") for part in device.split("/"))
    own = [rule for rule in rules if "SYMLINK" not in rule]
    expected = f'SUBSYSTEM=="tty", KERNEL=="{device}", MODE="0660", GROUP="dialout"'
    assert own == ([expected] if "/" not in device and device != "kobuki" else [])


LAUNCHED = (
    "system", "robot", "name", "task", "controller", "backend", "policy", "goals", "hardware", "adapter", "topic",
    "emulate", "markers",
)  # fmt: skip


@pytest.mark.parametrize("field", LAUNCHED)
@pytest.mark.parametrize("text", BREAKS)
def test_a_launch_argument_with_a_break_is_refused_by_its_name(field, text):
    with pytest.raises(ConfigError, match=f"^{field} = "):
        list_nodes(**{field: f"a{text}b"})


EXTERNAL = {"controller": "external", "robot": "floating_platform", "adapter": "zero_g_lab_valve_node"}
BESIDE = {"topic": EXTERNAL, "adapter": EXTERNAL, "hardware": {"backend": "hardware", "robot": "turtlebot2"}}


@pytest.mark.parametrize("field", sorted(set(LAUNCHED) - {"policy"}))
@pytest.mark.parametrize("text", ['a"b', "a'b", "a;b", "$(env HOME)", "%h", "../../etc/passwd"])
def test_a_launch_argument_that_is_no_name_is_refused_with_what_was_given(field, text):
    with pytest.raises(ConfigError) as refusal:
        list_nodes(**BESIDE.get(field, {}) | {field: text})
    assert text in str(refusal.value)


@pytest.mark.parametrize("text", ['a"b', "a;b", "$(env HOME)", "%h"])
def test_a_launched_folder_reaches_its_node_as_it_is(text, tmp_path):
    """As text with its type, which launch_ros neither reads as YAML nor fills in."""
    folder = shutil.copytree(shipped_policy("floating_platform", "go_to_pose"), tmp_path / text)
    rows = {row.name: row for row in list_nodes(system="mujoco_policy", policy=str(folder))}
    assert rows["controller"].parameters["policy"] == str(folder)


@pytest.mark.parametrize("program", PROGRAMS)
@given(text=TEXTS)
def test_a_layout_has_the_name_as_it_is_or_it_is_refused(program, text):
    try:
        layout = layout_text("turtlebot2", program, text)
    except ConfigError as error:
        assert "the name" in str(error)
        return
    assert text.isidentifier()
    (yaml.safe_load if program == "rviz" else json.loads)(layout)


@pytest.mark.parametrize(
    "text", [*(f"games{each}ExecStartPre=/bin/sh" for each in BREAKS), "0", "ro ot", "a;b", "%u", "$A"]
)
def test_a_user_who_is_no_name_is_one_line_and_writes_nothing(text, fulmar, tmp_path):
    code, _, messages = fulmar("service", "install", "mujoco_lqr", "--user", text, "--root", str(tmp_path))
    assert code == 2
    assert messages.startswith("fulmar: --user = ")
    assert len(messages.strip().splitlines()) == 1
    assert not [path for path in tmp_path.rglob("*") if not path.is_dir()]


def test_a_user_with_the_id_of_root_in_an_image_is_root(fulmar, tmp_path):
    (tmp_path / "etc").mkdir()
    (tmp_path / "etc/passwd").write_text("toor:x:0:0::/root:/bin/sh\n")
    code, _, messages = fulmar("service", "install", "mujoco_lqr", "--user", "toor", "--root", str(tmp_path))
    assert (code, "does not run as root" in messages) == (2, True)


def test_compose_passes_variables_as_whole_words_and_starts_no_shell():
    """Compose fills them in after it has read the YAML: a line break in one stays inside of its word."""
    path = Path(__file__).parents[2] / "docker" / "compose.yaml"
    for name, service in yaml.safe_load(path.read_text())["services"].items():
        assert isinstance(service["command"], list), name
        assert service["command"][0] in ("up", "train"), name


def test_a_service_that_flies_gets_the_time_to_land():
    assert "TimeoutStopSec=15\n" in unit_text(SERVICE, {})
    assert "TimeoutStopSec=315\n" in unit_text(replace(SERVICE, lands=True), {})
