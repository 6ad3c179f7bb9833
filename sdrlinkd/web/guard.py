"""Who may open the page: hosts, origins and the token, for HTTP and WebSocket alike."""

import hmac
import secrets
from http.cookies import CookieError, SimpleCookie
from urllib.parse import SplitResult, parse_qs, urlsplit

from starlette.datastructures import Headers
from starlette.responses import PlainTextResponse, RedirectResponse
from starlette.types import ASGIApp, Receive, Scope, Send

COOKIE = "sdrlink_token"
LOCAL_NAMES = ("localhost", "127.0.0.1", "::1")
NOT_FROM_HERE = (
    "this page is asked for under a name or from a page that is not its own; open it at the "
    "address that sdrlinkctl web printed\n"
)
NO_TOKEN = "this page needs its token: open it at the address that sdrlinkctl web printed\n"  # noqa: S105
WEBSOCKET_REFUSED = 4403


class Guard:
    """Lets only those requests through that may see the page.

    Without a token, a page on this host alone is open to its own address and origin: other pages in
    the same browser must not reach it. With one, whoever has it is let in.
    """

    def __init__(self, app: ASGIApp, token: str, *, is_local: bool, is_https: bool) -> None:
        self._app = app
        self._token = token
        self._is_local = is_local
        self._is_https = is_https

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or refuse it."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        if not self._is_own(headers):
            await _refuse(scope, receive, send, NOT_FROM_HERE)
        elif not self._token or self._knows(_cookie(headers)):
            await self._app(scope, receive, send)
        elif scope["type"] == "http" and self._knows(_asked_token(scope)):
            # The token does not stay in the address, where others may read it.
            answer = RedirectResponse(scope.get("root_path", "") + scope["path"], status_code=303)
            answer.set_cookie(
                COOKIE, self._token, httponly=True, samesite="strict", secure=self._is_https
            )
            await answer(scope, receive, send)
        else:
            await _refuse(scope, receive, send, NO_TOKEN)

    def _is_own(self, headers: Headers) -> bool:
        host = headers.get("host", "")
        if self._is_local and not self._token and _split(f"//{host}").hostname not in LOCAL_NAMES:
            return False
        origin = headers.get("origin")
        if origin is None:
            return True
        own = {host, headers.get("x-forwarded-host", host)} if self._token else {host}
        return _split(origin).netloc in own

    def _knows(self, token: str) -> bool:
        return hmac.compare_digest(token.encode(), self._token.encode())


def new_token() -> str:
    """A token that nobody guesses."""
    return secrets.token_urlsafe(18)


async def _refuse(scope: Scope, receive: Receive, send: Send, text: str) -> None:
    if scope["type"] == "websocket":
        await send({"type": "websocket.close", "code": WEBSOCKET_REFUSED})
        return
    await PlainTextResponse(text, status_code=403)(scope, receive, send)


def _cookie(headers: Headers) -> str:
    try:
        found = SimpleCookie(headers.get("cookie", "")).get(COOKIE)
    except CookieError:
        return ""
    return "" if found is None else str(found.value)


def _asked_token(scope: Scope) -> str:
    asked = parse_qs(str(scope.get("query_string", b""), "latin-1"))
    return asked.get("token", [""])[0]


def _split(url: str) -> SplitResult:
    """The parts of an address; empty ones of what is none."""
    try:
        return urlsplit(url)
    except ValueError:
        return urlsplit("")
