"""Who may ask the server for what: Host, Origin and token, and the headers of each answer."""

from __future__ import annotations

import hmac
import ipaddress
import secrets
import socket
from collections.abc import Iterable
from dataclasses import dataclass
from http.cookies import CookieError, SimpleCookie
from urllib.parse import parse_qs, urlsplit

COOKIE = "fulmar_console"
TOKEN = "FULMAR_CONSOLE_TOKEN"  # environment variable: command lines can be read by other users
LOOPBACK = ("127.0.0.1", "localhost", "[::1]")
HEADERS = {
    "Content-Security-Policy": (
        "default-src 'self'; img-src 'self' blob:; connect-src 'self'; object-src 'none'; base-uri 'none'; "
        "form-action 'none'; frame-ancestors 'none'"
    ),
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",  # else a link would carry the token away
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
}


def new_token() -> str:
    """A token that nobody guesses."""
    return secrets.token_urlsafe(24)


def is_loopback(address: str) -> bool:
    """Whether an address is reached from this computer alone."""
    try:
        return ipaddress.ip_address(address.strip("[]")).is_loopback
    except ValueError:
        return address == "localhost"


@dataclass(frozen=True)
class Access:
    """The rules of one server.

    Attributes:
        address: That the server listens on.
        port: Likewise.
        token: Without which a page shows and does nothing but stop; empty on loopback.
    """

    address: str
    port: int
    token: str = ""

    def why_refused(self, hosts: Iterable[str], origins: Iterable[str], *, upgrade: bool) -> str:
        """Why a request is refused; empty where it is not.

        A page of another site can send requests here, and can have its own name resolve to this address; the browser
        names its origin and the name that it used.

        Args:
            hosts: Values of the header Host.
            origins: Values of the header Origin.
            upgrade: To a websocket, for which every browser names the origin.
        """
        host, origin = list(hosts), list(origins)
        if len(host) != 1 or not self._is_ours(host[0]):
            return f"Host '{', '.join(host)}' is not this console's. Open http://{self._shown()}"
        if (origin or upgrade) and origin != [f"http://{host[0]}"]:
            return f"Origin '{', '.join(origin)}' is not this console's page. Open http://{self._shown()}"
        return ""

    def knows(self, cookies: Iterable[str]) -> bool:
        """Whether a request comes from a page that had the token, or needs none."""
        return not self.token or any(self._fits(each) for each in map(_cookie, cookies))

    def cookie_for(self, path: str) -> str:
        """The cookie for a request whose address has the token; empty where it has none, or a wrong one."""
        offered = parse_qs(urlsplit(path).query).get("token", [""])[0]
        if not self.token or not self._fits(offered):
            return ""
        return f"{COOKIE}={self.token}; HttpOnly; SameSite=Strict; Path=/"

    def _fits(self, offered: str) -> bool:
        return hmac.compare_digest(offered.encode(), self.token.encode())

    def _is_ours(self, host: str) -> bool:
        name, _, port = host.rpartition(":")
        if not name or not port.isdecimal():
            name, port = host, "80"
        if port != str(self.port):
            return False
        if name in LOOPBACK:
            return True
        if is_loopback(self.address):
            return False
        return name == self.address or (self._is_any and (_is_number(name) or name == socket.gethostname()))

    @property
    def _is_any(self) -> bool:
        """Whether the server listens on each address of this computer."""
        return self.address in ("0.0.0.0", "::")

    def _shown(self) -> str:
        return f"{'127.0.0.1' if self._is_any else self.address}:{self.port}"


def _cookie(header: str) -> str:
    try:
        found = SimpleCookie(header).get(COOKIE)
    except CookieError:
        return ""
    return found.value if found is not None else ""


def _is_number(name: str) -> bool:
    try:
        ipaddress.ip_address(name.strip("[]"))
    except ValueError:
        return False
    return True
