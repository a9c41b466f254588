"""`fulmar doctor`: each check finds what is really wrong, and names the command that repairs it."""

from __future__ import annotations

import contextlib
import grp
import json
import os
import resource
import shutil
import socket
import subprocess
import sys
import tempfile
from pathlib import Path
from types import SimpleNamespace

import pytest

from fulmar_bringup import robot_operator
from fulmar_cli.diagnosis import checks
from fulmar_cli.diagnosis.check_result import Finding
from fulmar_cli.diagnosis.devices import check_permissions, devices_of
from fulmar_cli.diagnosis.installation import check_policies, check_python
from fulmar_cli.diagnosis.machine import (
    check_clock,
    check_disk_space,
    check_disk_speed,
    check_governor,
    check_real_time,
    check_timing,
    kernel_clock,
)
from fulmar_cli.diagnosis.network import (
    check_discovery,
    check_multicast,
    check_profile,
    check_receive_buffer,
    check_running_robots,
)
from fulmar_cli.diagnosis.sockets import Listener, check_sockets, listeners

RANGE, STRANGER = (
    "ROS_AUTOMATIC_DISCOVERY_RANGE",
    "198.51.100.7",
)  # an address that no computer has (RFC 5737)
NAMESPACE = ["unshare", "--map-root-user", "--net"]  # without any interface that is up
MAY_UNSHARE = (
    shutil.which("unshare") and not subprocess.run([*NAMESPACE, "true"], capture_output=True).returncode
)
NOBODY = 65534
HOUR = 3600.0


@contextlib.contextmanager
def limited(which: int, soft: int):
    """A limit of this process, until the context ends."""
    before, hard = resource.getrlimit(which)
    resource.setrlimit(which, (soft, hard))
    try:
        yield
    finally:
        resource.setrlimit(which, (before, hard))


@pytest.fixture
def no_rights(tmp_path):
    """A process without capabilities, as Linux lists it."""
    path = tmp_path / "status"
    path.write_text("Name:\tfulmar\nCapEff:\t0000000000000000\n")
    return path


@pytest.mark.parametrize(
    ("environment", "hardware", "level", "fix"),
    [
        ({}, False, "ok", ""),
        (
            {},
            True,
            "advice",
            "export ROS_STATIC_PEERS=ADDRESS   # of the operator's computer, docs/security.md",
        ),
        ({"ROS_STATIC_PEERS": "10.0.0.2"}, True, "ok", ""),
        ({RANGE: "SUBNET"}, False, "ok", ""),
        ({RANGE: "SUBNET"}, True, "advice", f"unset {RANGE}   # and set ROS_STATIC_PEERS, docs/security.md"),
        ({RANGE: "OFF"}, False, "wrong", f"export {RANGE}=LOCALHOST"),
        ({RANGE: "EVERYWHERE"}, False, "wrong", f"export {RANGE}=LOCALHOST"),
        ({"ROS_DOMAIN_ID": "233"}, False, "wrong", "export ROS_DOMAIN_ID=0"),
        ({"ROS_DOMAIN_ID": "lab"}, False, "wrong", "export ROS_DOMAIN_ID=0"),
        ({"ROS_DOMAIN_ID": "150"}, False, "advice", "export ROS_DOMAIN_ID=101   # or less"),
        ({RANGE: "SUBNET", "ROS_LOCALHOST_ONLY": "1"}, True, "advice", "unset ROS_LOCALHOST_ONLY"),
    ],
)
def test_a_discovery_range_that_hides_nodes_is_found(environment, hardware, level, fix):
    finding = check_discovery(environment, hardware=hardware)
    assert (finding.level, finding.fix) == (level, fix)


def test_a_datagram_goes_through_loopback_and_comes_back():
    finding = check_multicast({})
    assert (finding.level, finding.found) == ("ok", "sent and received through 127.0.0.1")


def test_no_multicast_is_wrong_only_where_discovery_needs_it():
    wide, local = check_multicast({RANGE: "SUBNET"}, address=STRANGER), check_multicast({}, address=STRANGER)
    assert (wide.level, local.level) == ("wrong", "advice")
    assert f"no multicast through {STRANGER}: " in wide.found
    assert "ufw allow in proto udp to 224.0.0.0/4" in wide.fix


@pytest.mark.skipif(
    not MAY_UNSHARE,
    reason="a host without loopback or multicast needs a network namespace, which this kernel refuses this user; the "
    "checks themselves run above on the host as it is",
)
@pytest.mark.parametrize(
    ("before", "environment", "level", "words"),
    [
        ("true", {}, "wrong", "loopback is down"),
        ("true", {RANGE: "SUBNET"}, "wrong", "Network is unreachable"),
        ("ip link set lo up && sysctl -qw net.ipv4.igmp_max_memberships=0", {}, "advice", "No buffer space"),
        ("ip link set lo up", {}, "ok", "sent and received"),
    ],
)
def test_a_network_that_carries_no_multicast_is_found(before, environment, level, words):
    ask = (
        "import json; from fulmar_cli.diagnosis.network import check_multicast; "
        f"print(json.dumps(check_multicast({environment!r}).as_dict()))"
    )
    script = f'{before} && exec "$0" -c "$1"'
    done = subprocess.run(
        [*NAMESPACE, "sh", "-c", script, sys.executable, ask], capture_output=True, text=True, check=True
    )
    finding = json.loads(done.stdout)
    assert finding["level"] == level
    assert words in finding["found"]


def test_a_profile_of_the_user_that_may_share_memory_is_named():
    assert check_profile({}).level == "ok"
    finding = check_profile({"FASTDDS_DEFAULT_PROFILES_FILE": "/etc/mine.xml"})
    assert (finding.level, "/etc/mine.xml is yours" in finding.found) == ("advice", True)


@pytest.mark.parametrize(("text", "level"), [("4194304", "ok"), ("212992", "advice"), ("", "ok")])
def test_sockets_that_may_keep_little_are_named_with_the_command_that_gives_them_more(tmp_path, text, level):
    (tmp_path / "rmem_max").write_text(text)
    finding = check_receive_buffer(tmp_path / "rmem_max")
    assert finding.level == level
    assert ("sysctl -w net.core.rmem_max=4194304" in finding.fix) == (level == "advice")


def test_sockets_that_other_hosts_can_reach_are_found_with_their_process_and_the_cause():
    here, everywhere = (
        Listener("127.0.0.1", 7410, "python (process 1)"),
        Listener("0.0.0.0", 7412, "talker (process 2)"),
    )

    def check(*found, **environment):
        return check_sockets(environment, found=found)

    assert check().level == check(here).level == "ok"
    finding = check(here, everywhere)
    assert finding.level == "advice"
    assert "talker (process 2)" in finding.found
    assert "0.0.0.0:7412" in finding.found
    assert "python" not in finding.found
    assert "range SUBNET" in check(everywhere, ROS_AUTOMATIC_DISCOVERY_RANGE="SUBNET").found
    assert "static peers" in check(everywhere, ROS_STATIC_PEERS="10.0.0.2").found
    own = check(everywhere, FASTRTPS_DEFAULT_PROFILES_FILE="/etc/mine.xml")
    assert "/etc/mine.xml" in own.found
    assert own.fix.startswith("unset FASTRTPS_DEFAULT_PROFILES_FILE")


def test_an_open_socket_of_the_domain_is_seen_on_this_computer():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as port:
        port.bind(("0.0.0.0", 7400 + 250 * 101 + 249))
        (found,) = [one for one in listeners(101) if one.port == port.getsockname()[1]]
    assert found.is_open
    assert str(os.getpid()) in found.process


def test_publishers_that_do_not_reach_a_running_robot_are_named(monkeypatch):
    for unfit in ([], ["/panel publishes std_msgs/msg/Int8 on /boat/estop"]):
        person = SimpleNamespace(look_at_wires=lambda unfit=unfit: ({"/boat"}, unfit))
        monkeypatch.setattr(robot_operator, "operator", lambda person=person: contextlib.nullcontext(person))
        finding = check_running_robots()
        assert finding.level == ("wrong" if unfit else "ok")
        assert finding.found == (unfit[0] if unfit else "boat")


def test_a_clock_that_nothing_synchronises_is_found():
    synchronised, error_s = kernel_clock()
    assert check_clock().level == ("ok" if synchronised else "advice")
    assert error_s >= 0.0
    loose, tight = check_clock(lambda: (False, 16.0)), check_clock(lambda: (True, 0.002))
    assert (loose.level, loose.fix.split()[:3]) == ("advice", ["sudo", "timedatectl", "set-ntp"])
    assert (tight.level, tight.found) == ("ok", "synchronised, at most 2.0 ms off")


def test_limits_that_keep_control_threads_from_going_first_are_found(no_rights):
    with limited(resource.RLIMIT_MEMLOCK, 65536), limited(resource.RLIMIT_RTPRIO, 0):
        finding = check_real_time(status=no_rights)
    assert finding.level == "advice"
    assert finding.found == "rtprio is 0, less than 20; memlock is 0 MB, less than 64 MB"
    assert "/etc/security/limits.d/" in finding.fix
    assert check_real_time(98, -1, status=no_rights).level == "ok"


def test_capabilities_count_more_than_limits(no_rights):
    no_rights.write_text("CapEff:\t0000000000804000\n")  # CAP_SYS_NICE and CAP_IPC_LOCK
    assert check_real_time(0, 0, status=no_rights).level == "ok"
    no_rights.write_text("CapEff:\t0000000000004000\n")
    assert check_real_time(0, 0, status=no_rights).found == "rtprio is 0, less than 20"


def test_a_governor_that_saves_energy_is_found(tmp_path):
    assert check_governor(tmp_path).level == "ok"  # a machine without one
    for number, governor in enumerate(("performance", "performance", "powersave")):
        file = tmp_path / f"cpu{number}" / "cpufreq" / "scaling_governor"
        file.parent.mkdir(parents=True)
        file.write_text(f"{governor}\n")
    finding = check_governor(tmp_path)
    assert (finding.level, finding.found) == ("advice", "performance, powersave: it wakes late")
    assert "tee /sys/devices/system/cpu/cpu*/cpufreq/scaling_governor" in finding.fix
    file.write_text("performance\n")
    assert check_governor(tmp_path).level == "ok"


def test_a_loop_that_wakes_late_is_wrong_only_on_a_robot():
    assert check_timing(hardware=True, most_ms=0.0).level == "wrong"
    assert check_timing(hardware=False, most_ms=0.0).level == "advice"
    assert check_timing(hardware=True, most_ms=1e6).level == "ok"


def test_a_disk_without_room_is_wrong(tmp_path):
    assert check_disk_space(tmp_path, least_bytes=0).level == "ok"
    assert check_disk_space(tmp_path, least_bytes=10**18).level == "wrong"


def test_a_slow_disk_is_advice_and_one_that_takes_nothing_is_wrong(tmp_path):
    assert check_disk_speed(tmp_path, least_mb_s=0.0).level == "ok"
    slow = check_disk_speed(tmp_path, least_mb_s=1e9)
    assert slow.level == "advice"
    assert "--record" in slow.fix
    with limited(resource.RLIMIT_FSIZE, 1_000_000):
        full = check_disk_speed(tmp_path)
    assert full.level == "wrong"
    assert "cannot be written: File too large" in full.found
    assert check_disk_speed(tmp_path / "none").level == "wrong"
    assert list(tmp_path.iterdir()) == []


@pytest.fixture
def port():
    """A file in place of a serial port, in a folder that everybody may enter."""
    folder = Path(tempfile.mkdtemp(prefix="fulmar_dev_"))
    folder.chmod(0o755)
    path = folder / "ttyUSB0"
    path.touch()
    yield path
    shutil.rmtree(folder)


def test_a_port_that_this_user_may_not_open_is_wrong_on_a_robot(port):
    assert devices_of(port.parent) == [port]
    assert check_permissions([port], hardware=True).level == "ok"
    port.chmod(0o000)
    with _without_root():
        found = [check_permissions([port], hardware=hardware) for hardware in (True, False)]
    assert [finding.level for finding in found] == ["wrong", "advice"]
    assert found[0].fix == f"sudo chown $USER {port}"  # its group may not, either
    assert f"no right to read and write {port}" in found[0].found


@pytest.mark.skipif(
    os.geteuid() != 0, reason="the kernel lets only root give a file to a group that it is not in"
)
def test_a_port_of_a_group_is_opened_by_joining_the_group(port):
    group = next(each for each in grp.getgrall() if each.gr_gid not in (0, NOBODY))
    os.chown(port, 0, group.gr_gid)
    port.chmod(0o660)
    with _without_root():
        finding = check_permissions([port], hardware=True)
    assert finding.fix == f"sudo usermod -aG {group.gr_name} $USER && newgrp {group.gr_name}"


def test_without_ports_there_is_nothing_to_open(tmp_path):
    finding = check_permissions(devices_of(tmp_path), hardware=True)
    assert (finding.level, finding.found) == ("ok", "none here")


def test_a_python_that_nobody_tests_with_is_wrong():
    assert [check_python(version).level for version in ((3, 10, 4), (3, 14, 1), (3, 15, 0))] == [
        "wrong",
        "ok",
        "wrong",
    ]


def test_only_what_is_wrong_fails_and_every_finding_has_its_level_and_its_fix(fulmar, monkeypatch):
    advice = Finding("clock", "advice", "nothing synchronises it", "sudo timedatectl set-ntp true")
    wrong = Finding("disk space", "wrong", "0.1 GB free here", "du -sh runs/*")
    for findings, code in (([advice], 0), ([advice, wrong], 1)):
        monkeypatch.setattr(checks, "diagnose", lambda *_, findings=findings: findings)
        ended, out, _ = fulmar("doctor", "--json")
        assert (ended, json.loads(out)["healthy"]) == (code, not code)
        assert [(each["level"], each["fix"]) for each in json.loads(out)["findings"]] == [
            (finding.level, finding.fix) for finding in findings
        ]
    _, out, _ = fulmar("doctor")
    assert out.splitlines() == [
        "advice clock: nothing synchronises it",
        "       fix: sudo timedatectl set-ntp true",
        "wrong  disk space: 0.1 GB free here",
        "       fix: du -sh runs/*",
    ]


@pytest.mark.parametrize(
    ("words", "there", "absent"),
    [
        (
            ["--for", "sim"],
            {"mujoco", "multicast", "disk speed"},
            {"clock", "real-time limits", "CPU governor"},
        ),
        (["--for", "hardware", "zero_g_lab"], {"clock", "CPU governor", "zero_g_lab: device"}, {"mujoco"}),
    ],
)
def test_a_robot_and_a_simulation_are_asked_for_what_each_of_them_needs(fulmar, words, there, absent):
    code, out, _ = fulmar("doctor", *words, "--json")
    findings = json.loads(out)["findings"]
    names = {finding["what"] for finding in findings}
    assert there <= names
    assert not absent & names
    assert code == any(finding["level"] == "wrong" for finding in findings)
    assert all(bool(finding["fix"]) == (finding["level"] != "ok") for finding in findings)


@contextlib.contextmanager
def _without_root():
    """The rights of nobody, where we are root."""
    if os.geteuid() != 0:
        yield
        return
    groups = os.getgroups()
    os.setgroups([])
    os.setegid(NOBODY)
    os.seteuid(NOBODY)
    try:
        yield
    finally:
        os.seteuid(0)
        os.setegid(0)
        os.setgroups(groups)


def test_every_shipped_policy_loads_and_fits_its_robot():
    finding = check_policies()
    assert finding.level == "ok", finding.found
    assert "floating_platform_go_to_pose" in finding.found
