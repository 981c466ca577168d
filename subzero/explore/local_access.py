"""Access to a page on this machine for the owner's browser, and for nothing else.

Any program of this machine can open a port on it, and any site in the owner's browser can send requests there. So a
random token stands in the address that is printed; the first visit with it leaves a cookie, without which nothing is
answered. A request must name this machine as its host (a site may let its own name lead here), and must come from no
other site (`Origin`), websockets too. No other site may show the page in a frame.

Deliberately left out: another server of this machine on the same host name gets the cookie, too, if the owner's browser
visits it; browsers do not tell ports apart.
"""

from __future__ import annotations

import secrets
from collections.abc import Awaitable, Callable, MutableMapping
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qs

HOST = "127.0.0.1"
NAMES = (HOST, "localhost")
HTTP_PORT = 80
"""A browser leaves this port out of the names of a host and an origin."""
TOKEN_BYTES = 32
HEADERS = (
    (b"content-security-policy", b"frame-ancestors 'self'"),
    (b"x-frame-options", b"SAMEORIGIN"),
    (b"x-content-type-options", b"nosniff"),
    (b"referrer-policy", b"same-origin"),
)
"""Of every answer: the page may be framed by itself alone."""

Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
Application = Callable[[Message, Receive, Send], Awaitable[None]]


class Access:
    """Who may reach a page.

    Args:
        port: of the page on this machine.

    Attributes:
        url: address of the page, with the token.
    """

    def __init__(self, port: int) -> None:
        place = "" if port == HTTP_PORT else f":{port}"
        self._hosts = {f"{name}{place}".encode() for name in NAMES}
        self._token, self._cookie = secrets.token_urlsafe(TOKEN_BYTES), f"subzero_explore_{port}"
        self.url = f"http://{HOST}:{port}/?token={self._token}"

    def guarded(self, application: Application) -> Application:
        """Return an ASGI application that answers those alone who may reach it."""

        async def answer(scope: Message, receive: Receive, send: Send) -> None:
            if scope["type"] == "lifespan":
                await application(scope, receive, send)
                return
            has_token = self._is_token(_query(scope))
            refusal = self._refusal(scope, has_token=has_token)
            added = (*HEADERS, (b"set-cookie", self._new_cookie())) if has_token else HEADERS
            await (
                _refuse(scope, send, *refusal) if refusal else application(scope, receive, _with(added, send))
            )

        return answer

    def _refusal(self, scope: Message, *, has_token: bool) -> tuple[int, str] | None:
        """Return status and words for a request that is not let in."""
        hosts, origins = _all(scope, b"host"), _all(scope, b"origin")
        if len(hosts) != 1 or hosts[0] not in self._hosts:
            return 400, "This page is reached by the name of this machine alone."
        if any(origin != b"http://" + hosts[0] for origin in origins):
            return 403, "Another site may not use this page."
        if not (has_token or self._has_cookie(scope)):
            return 403, "Open the address that subzero explore has printed, with its token."
        return None

    def _is_token(self, text: str) -> bool:
        """Compare in a time that says nothing of where two differ."""
        return secrets.compare_digest(text.encode(), self._token.encode())

    def _has_cookie(self, scope: Message) -> bool:
        try:
            cookies = SimpleCookie(b"; ".join(_all(scope, b"cookie")).decode("latin-1"))
        except CookieError:
            return False
        return self._cookie in cookies and self._is_token(cookies[self._cookie].value)

    def _new_cookie(self) -> bytes:
        return f"{self._cookie}={self._token}; Path=/; HttpOnly; SameSite=Strict".encode()


def _query(scope: Message) -> str:
    """Return the token in the address of a page; a websocket has none."""
    if scope["type"] != "http":
        return ""
    query: bytes = scope["query_string"]
    return parse_qs(query.decode("latin-1")).get("token", [""])[0]


def _all(scope: Message, name: bytes) -> list[bytes]:
    """Return all headers of a name."""
    return [value for key, value in scope["headers"] if key == name]


async def _refuse(scope: Message, send: Send, status: int, words: str) -> None:
    """Answer a request that is not let in."""
    if scope["type"] == "websocket":
        await send({"type": "websocket.close", "code": 1008})
        return
    kind = (b"content-type", b"text/plain; charset=utf-8")
    await send({"type": "http.response.start", "status": status, "headers": [kind, *HEADERS]})
    await send({"type": "http.response.body", "body": f"{words}\n".encode()})


def _with(headers: tuple[tuple[bytes, bytes], ...], send: Send) -> Send:
    """Return a function that sends an answer with headers added."""

    async def sent(message: Message) -> None:
        if message["type"] == "http.response.start":
            message["headers"] = [*message["headers"], *headers]
        await send(message)

    return sent
