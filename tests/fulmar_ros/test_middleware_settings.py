"""Which Fast DDS profile a process gets, and what the profiles have in common."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree

import pytest

from fulmar_cli.diagnosis.network import RECEIVE_BYTES
from fulmar_ros import middleware
from fulmar_ros.middleware import (
    DISCOVERY_RANGE,
    LOOPBACK,
    NETWORK,
    PEERS,
    PROFILES,
    STATIC_PEERS,
    discovery_range,
    environment_of_any_node,
    middleware_environment,
    own_profile,
    range_for_rclpy,
    strangers_can_send,
)

SUBNET, PEER = {DISCOVERY_RANGE: "SUBNET"}, {STATIC_PEERS: "10.0.0.2"}


@pytest.fixture
def environment(monkeypatch):
    for name in (DISCOVERY_RANGE, STATIC_PEERS, *PROFILES):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(middleware, "_loaded", [])
    return monkeypatch


@pytest.mark.parametrize(
    ("variables", "profile", "filtered"),
    [
        ({}, LOOPBACK, False),
        ({DISCOVERY_RANGE: "LOCALHOST"}, LOOPBACK, False),
        ({DISCOVERY_RANGE: "OFF"}, LOOPBACK, False),
        (SUBNET, NETWORK, False),
        (SUBNET | PEER, NETWORK, False),
        (PEER, PEERS, True),
    ],
)
def test_nodes_listen_on_the_network_only_where_range_or_peers_ask_for_it(variables, profile, filtered):
    assert own_profile(variables) == profile
    assert strangers_can_send(variables) is filtered


def test_the_profile_follows_a_range_that_changed_since_a_parent_chose_it(environment):
    for name, value in middleware_environment().items():
        environment.setenv(name, value)
    environment.setenv(DISCOVERY_RANGE, "SUBNET")
    assert {middleware_environment()[name] for name in PROFILES} == {str(NETWORK)}


@pytest.mark.parametrize(
    ("variables", "read"),
    [
        ({}, "SYSTEM_DEFAULT"),
        (PEER, "SUBNET"),
        (SUBNET, "SUBNET"),
    ],
)
def test_a_node_that_is_not_of_fulmar_gets_the_range_of_its_profile_which_ours_read_as_what_was_meant(
    variables, read
):
    given = variables | environment_of_any_node(variables)
    assert given[DISCOVERY_RANGE] == read
    assert own_profile(given) == own_profile(variables)
    assert discovery_range(given) == discovery_range(variables)
    assert environment_of_any_node(given) == {name: given[name] for name in (DISCOVERY_RANGE, *PROFILES)}


@pytest.mark.parametrize("name", PROFILES)
def test_a_profile_of_the_user_is_left_alone(environment, name):
    environment.setenv(name, "/etc/mine.xml")
    assert middleware_environment() == {DISCOVERY_RANGE: "LOCALHOST"}
    environment.setenv(STATIC_PEERS, "10.0.0.2")
    assert not strangers_can_send({name: "/etc/mine.xml", STATIC_PEERS: "10.0.0.2"})


def test_rclpy_leaves_the_transports_to_a_profile_that_is_bound_to_loopback_alone(environment):
    def seen() -> str:
        for name, value in middleware_environment().items():
            environment.setenv(name, value)
        with range_for_rclpy():
            inside = middleware.os.environ[DISCOVERY_RANGE]
        return f"{inside} {middleware.os.environ[DISCOVERY_RANGE]}"

    assert seen() == "SYSTEM_DEFAULT LOCALHOST"
    environment.setenv(STATIC_PEERS, "10.0.0.2")
    assert seen() == "LOCALHOST LOCALHOST"
    environment.setattr(middleware, "_loaded", [str(PEERS)])
    assert seen() == "SUBNET LOCALHOST"
    environment.delenv(STATIC_PEERS)
    environment.setattr(middleware, "_loaded", [str(NETWORK)])  # of this process, and read but once
    assert seen() == "LOCALHOST LOCALHOST"


def test_the_profiles_differ_in_their_transports_only():
    def rest(path):
        root = ElementTree.parse(path).getroot()
        for parent in list(root.iter()):
            for child in list(parent):
                if child.tag.rpartition("}")[2] in (
                    "transport_descriptors", "useBuiltinTransports", "userTransports", "metatrafficUnicastLocatorList",
                    "initialPeersList",
                ):  # fmt: skip
                    parent.remove(child)
        return [(element.tag, element.attrib, (element.text or "").strip()) for element in root.iter()]

    assert rest(NETWORK) == rest(LOOPBACK) == rest(PEERS)


@pytest.mark.parametrize("path", sorted(middleware.OWN_PROFILES))
def test_nodes_share_no_memory_in_which_one_that_dies_could_block_the_others(path):
    found = {
        element.tag.rpartition("}")[2]: element.text for element in ElementTree.parse(path).getroot().iter()
    }
    assert (found["useBuiltinTransports"], found["type"]) == ("false", "UDPv4")
    assert found["receiveBufferSize"] == str(RECEIVE_BYTES)
