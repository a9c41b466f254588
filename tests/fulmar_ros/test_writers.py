"""Which nodes publish to a subscription, as the graph shows them."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from fulmar_ros.graph import UNNAMED, UNNAMED_NODE, WriterWatch, writers_of

S = 1_000_000_000


def seen(*writers: tuple[int, str]) -> tuple[SimpleNamespace, SimpleNamespace]:
    """A node in whose graph these publish, each by its process and its name, and its subscription."""
    infos = [
        SimpleNamespace(endpoint_gid=[process] * 12 + [number] * 4, node_namespace="/alpha", node_name=name)
        for number, (process, name) in enumerate(writers)
    ]
    node = SimpleNamespace(get_publishers_info_by_topic=lambda _topic: infos)
    return node, SimpleNamespace(get_publisher_count=lambda: len(infos), topic_name="/alpha/odom")


@pytest.mark.parametrize(
    ("writers", "names"),
    [
        ([(1, "plant")], []),
        ([(1, "plant"), (1, "plant")], ["/alpha/plant"]),
        ([(1, "plant"), (2, "estimator")], ["/alpha/estimator", "/alpha/plant"]),
    ],
)
def test_a_node_counts_once_however_many_publishers_it_has(writers, names):
    assert writers_of(*seen(*writers)) == names


def test_two_processes_with_nodes_of_one_name_are_two_writers():
    assert writers_of(*seen((1, "plant"), (2, "plant"))) == ["/alpha/plant", "/alpha/plant"]


def test_an_input_of_two_nodes_is_not_followed_and_the_alarm_waits_for_their_names():
    node, subscription = seen((1, "plant"), (2, UNNAMED_NODE))
    watch = WriterWatch(node, {"odom": [subscription]})
    assert watch.look(S).startswith("2 nodes publish odom, and only one may")
    assert watch.alarm == ""
    assert UNNAMED in watch.look(3 * S)
    assert UNNAMED in watch.alarm
