"""The console's server refuses what is not its own page's, and does each command at most once, in time."""

from __future__ import annotations

import gzip
import hashlib
import shutil
import struct
import subprocess
import time

import pytest
from websockets.exceptions import InvalidStatus

from fulmar_console.pages import FOLDER, Pages
from fulmar_console.process import bound
from fulmar_core.config.errors import ConfigError
from tests.fulmar_console.served import served

TOKEN = "a-token-that-nobody-knows"
VENDOR = FOLDER.parents[1] / "vendor" / "vendor.sha256"
BY_HAND = [file for file in sorted(FOLDER.glob("*.js")) if file.name != "vendor.js"]


@pytest.fixture(scope="module")
def console():
    with served() as running:
        yield running


@pytest.fixture(scope="module")
def guarded():
    with served(TOKEN) as running:
        yield running


def test_a_plain_request_gets_the_page_and_a_policy_that_lets_no_other_code_in(console):
    status, headers, body = console.get()
    assert status == 200 and b"<html" in body
    assert "default-src 'self'" in headers["Content-Security-Policy"]
    assert headers["X-Frame-Options"] == "DENY" and headers["Referrer-Policy"] == "no-referrer"


def test_files_are_compressed_only_for_who_asks(console):
    _, headers, plain = console.get("/main.js")
    assert "Content-Encoding" not in headers
    _, headers, packed = console.get("/main.js", Accept_Encoding="gzip")
    assert headers["Content-Encoding"] == "gzip" and gzip.decompress(packed) == plain


@pytest.mark.parametrize("path", ["/../server.py", "/page/main.js", "/main.py", "//etc/passwd", "/%2e%2e/x"])
def test_no_path_leads_out_of_the_list_of_files(console, path):
    assert console.get(path)[0] == 404


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1", "127.0.0.1:1", "evil.example:80"])
def test_a_request_by_another_name_of_this_computer_is_refused(console, host):
    status, _, body = console.get(Host=host)
    assert status == 403 and b"Host" in body


def test_a_page_of_another_site_is_refused_on_page_and_socket(console):
    assert console.get(Origin="http://evil.example")[0] == 403
    with pytest.raises(InvalidStatus, match="403"), console.page(origin="http://evil.example"):
        pass
    with pytest.raises(InvalidStatus, match="403"), console.page(origin=None):
        pass


def test_a_page_gets_version_robots_health_and_frames(console):
    with console.page() as page:
        assert page.hello["version"] == Pages().version and page.hello["controls"]
        assert page.until("health")["robots"]["boat"]["words"] == "secret"
        frame = page.until("frame")
    kind, _, robots, _, _, age, _ = struct.unpack_from("<BBHIdfI", frame)
    index, shares, pose_age, x, *_ = struct.unpack_from("<HH8f", frame, 24)
    assert (kind, robots, age, index, shares, x) == (1, 1, 0.0, 0, 2, 1.0) and 0.0 < pose_age < 1.0
    assert struct.unpack_from("<2b", frame, 60) == (64, -127)


def test_the_page_has_the_version_of_the_server_so_that_an_older_one_notices(console):
    assert console.get()[2].count(Pages().version.encode()) == 1


def test_a_command_is_done_once_and_not_again(console):
    with console.page() as page:
        assert page.ask(id=7, do="reset")["accepted"]
        before = len(console.source.done)
        again = page.ask(id=7, do="reset")
        assert not again["accepted"] and "repetition" in again["words"]
        assert len(console.source.done) == before


@pytest.mark.parametrize(
    ("command", "words"),
    [
        ({"do": "reset", "at": 1.0}, "too late"),
        ({"do": "reset", "session": "another"}, "reload"),
        ({"do": "resett"}, "Did you mean 'reset'?"),
        ({"do": "reset", "robot": "boot"}, "Did you mean 'boat'?"),
        ({"do": "rate"}, "needs rate"),
        ({"do": "reset", "id": True}, "repetition"),
    ],
)
def test_a_command_that_is_wrong_is_refused_in_words(console, command, words):
    with console.page() as page:
        before = len(console.source.done)
        answer = page.ask(**command)
        assert not answer["accepted"] and words in answer["words"]
        assert len(console.source.done) == before


@pytest.mark.parametrize("text", ["", "[]", "{", '{"do": "rate", "rate": 1e999}', '{"do": NaN}', b"\x00"])
def test_what_is_no_command_is_refused_and_the_page_stays(console, text):
    with console.page() as page:
        page.socket.send(text)
        assert not page.until("answer")["accepted"]
        assert page.ask(id=9, do="reset")["accepted"]


def test_a_stop_is_done_whatever_its_age_number_and_session(console):
    with console.page() as page:
        assert page.ask(do="estop", robot="*", id=-1, at=0.0, session="")["accepted"]
    assert console.source.done[-1]["do"] == "estop"


def test_a_page_that_goes_is_forgotten(console):
    with console.page() as page:
        name = page.hello["client"]
    until = time.monotonic() + 5.0
    while name not in console.source.gone and time.monotonic() < until:
        time.sleep(0.01)
    assert name in console.source.gone


def test_without_the_token_a_page_can_stop_and_nothing_else(guarded):
    with guarded.page() as page:
        assert not page.hello["controls"]
        assert "words" not in page.until("health")["robots"]["boat"]
        refused = page.ask(do="reset")
        assert not refused["accepted"] and "token" in refused["words"]
        assert page.ask(id=2, do="estop", robot="*")["accepted"]


def test_a_wrong_token_opens_nothing(guarded):
    status, headers, _ = guarded.get("/?token=wrong")
    assert status == 200 and "Set-Cookie" not in headers
    with guarded.page(additional_headers={"Cookie": "fulmar_console=wrong"}) as page:
        assert not page.hello["controls"]
    assert guarded.get("/bags/0.bin")[0] == 404


def test_the_token_of_the_address_becomes_a_cookie_that_no_script_reads(guarded):
    status, headers, _ = guarded.get(f"/?token={TOKEN}")
    assert status == 303 and headers["Location"] == "/"
    assert "HttpOnly" in headers["Set-Cookie"] and "SameSite=Strict" in headers["Set-Cookie"]
    with guarded.page(additional_headers={"Cookie": headers["Set-Cookie"].split(";")[0]}) as page:
        assert page.hello["controls"] and page.ask(do="reset")["accepted"]


def test_a_taken_port_is_refused_in_one_line(console):
    with pytest.raises(ConfigError, match="another program listens"):
        bound("127.0.0.1", console.port)


def test_the_bundle_of_outside_code_is_the_one_that_was_made():
    rows = (line.split() for line in VENDOR.read_text(encoding="utf-8").splitlines())
    for digest, name in rows:
        assert hashlib.sha256((FOLDER / name).read_bytes()).hexdigest() == digest, name


def test_the_page_is_at_most_1800_lines_by_hand():
    assert sum(len(file.read_text(encoding="utf-8").splitlines()) for file in BY_HAND) <= 1800


def test_every_module_of_the_page_is_javascript():
    node = shutil.which("node")
    if node is None:
        pytest.skip("node is not installed; the browser's tests load each module, too")
    subprocess.run([node, "--check", *map(str, BY_HAND)], check=True, timeout=30)
