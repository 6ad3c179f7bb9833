"""Who may open the page: hosts, origins and the token, for HTTP and WebSocket alike."""

from http.cookies import CookieError, SimpleCookie

from starlette.datastructures import Headers
from starlette.responses import PlainTextResponse, RedirectResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from sdrlinkd.doors import is_local_name, is_ours, is_token, split, token_in

COOKIE = "sdrlink_token"
NOT_FROM_HERE = (
    "this page is asked for under a name or from a page that is not its own; open it at the "
    "address that sdrlinkctl web printed\n"
)
OTHERS = (
    "this page is for the account that serves it; --token of sdrlinkctl web asks for a token "
    "instead\n"
)
SAFE = (
    (b"content-security-policy", b"frame-ancestors 'none'"),
    (b"x-frame-options", b"DENY"),
    (b"x-content-type-options", b"nosniff"),
    (b"referrer-policy", b"no-referrer"),
)
"""Headers of each answer: no page frames this one, and its address goes nowhere."""
NO_TOKEN = "this page needs its token: open it at the address that sdrlinkctl web printed\n"  # noqa: S105
WEBSOCKET_REFUSED = 4403


class Guard:
    """Lets only those requests through that may see the page.

    Without a token, a page on this host alone is open to programs of its own account, at its own
    address and origin: other pages in the same browser must not reach it. With one, whoever has it
    is let in.
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
        send = _safely(send)
        if not self._is_own(headers):
            await _refuse(scope, receive, send, NOT_FROM_HERE)
        elif self._is_local and not self._token and not is_ours(scope["client"], scope["server"]):
            await _refuse(scope, receive, send, OTHERS)
        elif not self._token or self._knows(_cookie(headers)):
            await self._app(scope, receive, send)
        elif scope["type"] == "http" and self._knows(_asked_token(scope)):
            # The token does not stay in the address, where others may read it.
            path = "/" + (scope.get("root_path", "") + scope["path"]).lstrip("/\\")
            answer = RedirectResponse(path, status_code=303)
            answer.set_cookie(
                COOKIE, self._token, httponly=True, samesite="strict", secure=self._is_https
            )
            await answer(scope, receive, send)
        else:
            await _refuse(scope, receive, send, NO_TOKEN)

    def _is_own(self, headers: Headers) -> bool:
        host = headers.get("host", "")
        if self._is_local and not self._token and not is_local_name(host):
            return False
        origin = headers.get("origin")
        if origin is None:
            return True
        own = {host, headers.get("x-forwarded-host", host)} if self._token else {host}
        return split(origin).netloc in own

    def _knows(self, token: str) -> bool:
        return is_token(token, self._token)


def _safely(send: Send) -> Send:
    """What sends answers with the headers in SAFE."""

    async def safe(message: Message) -> None:
        if message["type"] == "http.response.start":
            message = {**message, "headers": [*message.get("headers", ()), *SAFE]}
        await send(message)

    return safe


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
    return token_in(str(scope.get("query_string", b""), "latin-1"))
