"""Requests to change a controller and their answers, as the wires have them."""

from __future__ import annotations

import json

import pytest

from fulmar_core.config.errors import ConfigError
from fulmar_core.loop.swap_request import (
    LONGEST_NAME,
    LONGEST_PATH,
    SwapRequest,
    SwapResult,
    read_request,
    read_result,
    request_id,
)


@pytest.mark.parametrize("chosen", [{"controller": "lqr"}, {"bundle": "/policies/mine"}])
def test_a_request_is_read_as_it_was_written(chosen):
    request = SwapRequest("", "a-1", by="alice", **chosen)
    found = read_request(request.to_text())
    assert (found.id, found.by, found.controller, found.bundle) == (
        "a-1", "alice", request.controller, request.bundle,
    )  # fmt: skip


def test_a_text_that_is_no_object_is_the_folder_of_a_bundle():
    request = read_request("runs/bundles/first")
    assert (request.bundle, request.controller, request.id) == ("runs/bundles/first", "", "")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "1 to 4096"),
        ("x" * (LONGEST_PATH + 1), "1 to 4096"),
        ("{", "JSON object"),
        ("{}", "either 'controller'"),
        ('{"controller": "lqr", "bundle": "x"}', "either 'controller'"),
        ('{"controller": 3}', "'controller' of a request is a text"),
        ('{"controller": "a\\nb"}', "printable"),
        (json.dumps({"controller": "l" * (LONGEST_NAME + 1)}), "at most 200"),
        ('{"policy": "x"}', "no key 'policy'"),
        ("{" + " " * 9000 + "}", "at most 8192"),
    ],
)
def test_what_is_no_request_is_refused_with_what_is_allowed(text, words):
    with pytest.raises(ConfigError, match=words):
        read_request(text)


def test_the_id_of_a_request_that_is_refused_is_still_known():
    assert request_id('{"id": 3, "dance": true}') == 3
    assert [request_id(text) for text in ("", "{", '{"id": [1]}', '{"id": true}')] == [""] * 4


def test_an_answer_is_read_as_it_was_written_and_rubbish_is_none():
    result = SwapResult(3, True, "lqr controls", "lqr", "", "alice", "ab", 17)
    assert read_result(result.to_text()) == result
    assert read_result("{") is None
    assert read_result('{"id": 1}') is None
