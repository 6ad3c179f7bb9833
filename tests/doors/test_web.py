"""The page's door: other accounts of this computer, and what a frame may do."""

import http.client
import os
import socket
from contextlib import closing
from urllib.parse import urlsplit

import pytest

from sdrlinkd import doors
from tests.doors.accounts import OTHER_ACCOUNTS, status_for
from tests.programs import sdrlinkctl
from tests.web.conftest import page_of

SOCKET = "/_nicegui_ws/socket.io/?EIO=4&transport=websocket"


@pytest.mark.slow
def test_the_page_is_for_its_own_account_or_for_the_token(tmp_path):
    environment = {**os.environ, "SDRLINK_WEB_TOKEN": "opensesame"}
    for more in ([], ["--control"]):
        at = ("web", "--runtime-dir", tmp_path, "--listen", "127.0.0.1:0", *more)
        with sdrlinkctl(*at, environment=environment) as page:
            url = urlsplit(page_of(page))
            for account in OTHER_ACCOUNTS:
                for path in ("/", SOCKET):
                    assert status_for(account, url.port, path) == 403
            with closing(http.client.HTTPConnection("127.0.0.1", url.port)) as connection:
                connection.request("GET", f"/?{url.query}")
                answer = connection.getresponse()
                assert answer.status == (303 if more else 200)
                assert answer.getheader("content-security-policy") == "frame-ancestors 'none'"
                assert answer.getheader("x-frame-options") == "DENY"


@pytest.mark.parametrize(("family", "host"), [("AF_INET", "127.0.0.1"), ("AF_INET6", "::1")])
def test_whose_program_is_at_the_other_end(family, host, monkeypatch):
    with (
        socket.create_server((host, 0), family=getattr(socket, family)) as server,
        socket.create_connection(server.getsockname()[:2]),
        closing(server.accept()[0]) as end,
    ):
        ends = end.getpeername()[:2], end.getsockname()[:2]
        assert doors.is_ours(*ends)
        # The other way round it is the same; of what is not connected, nobody knows.
        assert doors.is_ours(*ends[::-1])
        assert not doors.is_ours((host, 1), ends[1])
        owner = os.geteuid()
        monkeypatch.setattr(doors, "ROOT", -1)
        monkeypatch.setattr(os, "geteuid", lambda: owner + 1)
        assert not doors.is_ours(*ends)


@pytest.mark.parametrize(
    ("origin", "is_let_in"),
    [
        ("http://localhost:8080", True), ("https://127.0.0.1", True), ("http://[::1]:3", True),
        ("https://app.example", True), ("null", False), ("", False), ("http://[", False),
        ("http://localhost.evil.example", False), ("https://app.example.evil", False),
        ("file://", False), ("http://app.example", False), ("ftp://localhost", False),
        ("http://evil.example/localhost", False), ("http://user@evil.example", False),
    ],
)  # fmt: skip
def test_pages_of_this_computer_and_those_named_are_let_in(origin, is_let_in):
    assert doors.is_allowed(origin, ["https://app.example"]) == is_let_in
