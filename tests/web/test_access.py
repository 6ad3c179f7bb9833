"""Who may open the page, and what it says to everybody else."""

import contextlib
import http.client
import os
import signal
import ssl
import subprocess
from urllib.parse import urlsplit

import pytest
import websocket

from sdrlinkd.cli import run
from tests.programs import sdrlinkctl
from tests.web.conftest import page_of

pytestmark = pytest.mark.slow

SOCKET = "/_nicegui_ws/socket.io/?EIO=4&transport=websocket"


@contextlib.contextmanager
def served(*options, folder, token=""):
    environment = {**os.environ, "SDRLINK_WEB_TOKEN": token}
    arguments = ("web", "--runtime-dir", folder, *options)
    with sdrlinkctl(*arguments, environment=environment) as process:
        yield urlsplit(page_of(process)), process


def get(url, path="/", **headers):
    opened = http.client.HTTPConnection("127.0.0.1", url.port, timeout=20)
    with contextlib.closing(opened) as connection:
        connection.request("GET", path, headers=headers)
        answer = connection.getresponse()
        return answer.status, answer.read().decode(errors="replace"), dict(answer.getheaders())


def joins(url, **headers):
    """Whether a WebSocket is let in."""
    given = [f"{name}: {value}" for name, value in headers.items() if name != "Origin"]
    try:
        opened = websocket.create_connection(
            f"ws://127.0.0.1:{url.port}{SOCKET}", header=given, origin=headers.get("Origin"),
            timeout=20,
        )  # fmt: skip
    except websocket.WebSocketBadStatusException:
        return False
    opened.close()
    return True


def test_other_pages_of_the_same_browser_do_not_reach_it(tmp_path):
    with served("--listen", "127.0.0.1:0", folder=tmp_path) as (url, _):
        own, strange = f"http://127.0.0.1:{url.port}", "http://evil.example"
        assert get(url)[0] == 200
        assert joins(url, Origin=own)
        assert not joins(url, Origin=strange)
        assert get(url, Origin=strange)[0] == 403
        assert get(url, Origin="http://[")[0] == 403
        assert get(url, Host="[")[0] == 403
        status, told, _ = get(url, Host="evil.example")
        assert status == 403
        assert "open it at the address" in told


def test_with_a_token_nobody_else_comes_in(tmp_path):
    with served("--listen", "127.0.0.1:0", "--token", folder=tmp_path, token="opensesame") as (
        url,
        _,
    ):
        assert url.query == "token=opensesame"
        own = f"http://127.0.0.1:{url.port}"
        status, told, _ = get(url)
        assert status == 403
        assert "needs its token" in told
        assert get(url, "/?token=wrong")[0] == 403
        assert not joins(url, Origin=own)
        status, _, headers = get(url, "/?token=opensesame")
        assert (status, headers["location"]) == (303, "/")
        assert "frame-ancestors 'none'" in headers["content-security-policy"]
        for path in ("//evil.example/x", "/\\evil.example/x", "///evil.example"):
            status, _, headers = get(url, f"{path}?token=opensesame")
            assert (status, headers["location"].lstrip("/")[:4]) == (303, "evil")
            assert not headers["location"].startswith(("//", "/\\"))
        cookie = headers["set-cookie"]
        assert "HttpOnly" in cookie
        assert "SameSite=strict" in cookie
        ours = cookie.split(";")[0]
        assert get(url, Cookie=ours)[0] == 200
        assert joins(url, Cookie=ours, Origin=own)
        assert not joins(url, Cookie=ours, Origin="http://evil.example")
        assert get(url, Cookie="sdrlink_token=x; ;;=")[0] == 403


def test_whoever_may_control_needs_the_token(tmp_path):
    with served("--listen", "127.0.0.1:0", "--control", folder=tmp_path) as (url, _):
        assert len(url.query) > 20
        assert get(url)[0] == 403
        assert get(url, f"/?{url.query}")[0] == 303


def test_a_token_may_contain_anything(tmp_path):
    token = 'a&b #"ü;='
    with served("--listen", "127.0.0.1:0", "--token", folder=tmp_path, token=token) as (url, _):
        status, _, headers = get(url, f"/?{url.query}")
        assert status == 303
        assert get(url, Cookie=headers["set-cookie"].split("; HttpOnly")[0])[0] == 200


def test_behind_a_proxy_its_name_counts(tmp_path):
    with served("--listen", "127.0.0.1:0", "--token", folder=tmp_path, token="t") as (url, _):
        ours = "sdrlink_token=t"
        assert joins(url, Cookie=ours, Host="127.0.0.1", Origin="https://mine.example",
                     **{"X-Forwarded-Host": "mine.example"})  # fmt: skip


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--listen", "nowhere"), "--listen: got"),
        (("--listen", "127.0.0.1:1", "--tls-cert", "a.pem"), "got one of them"),
        (("--tls-cert", "a", "--tls-key", "b"), "--tls-cert a: No such"),
        (("--floor-plan", "plan.yaml"), "plan.yaml: No such file"),
        (("--fleet", "a/b"), "--fleet: got"),
        (("--fleet", "a", "--connect", "base"), "--connect: got"),
        (("--fleet", "a", "--zenoh", "absent.json5", "--listen", "127.0.0.1:0"), "fleet.zenoh: "),
    ],
)  # fmt: skip
def test_what_would_be_unsafe_or_cannot_be_is_refused(options, said, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert run(["web", *options]) == 2
    assert said in capsys.readouterr().err


@pytest.mark.long
def test_beyond_this_host_it_warns(tmp_path):
    with served("--listen", "0.0.0.0:0", folder=tmp_path) as (url, process):
        assert get(url, Host="base:8420")[0] == 200
        assert "whoever reaches this port can read the page" in process.err()


@pytest.mark.long
def test_it_is_served_over_tls(tmp_path):
    subprocess.run(
        ["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1",
         "-nodes", "-days", "2", "-subj", "/CN=localhost", "-addext", "subjectAltName=IP:127.0.0.1",
         "-keyout", tmp_path / "key.pem", "-out", tmp_path / "cert.pem"],
        check=True, capture_output=True,
    )  # fmt: skip
    options = ("--tls-cert", tmp_path / "cert.pem", "--tls-key", tmp_path / "key.pem")
    with served("--listen", "127.0.0.1:0", *options, folder=tmp_path) as (url, _):
        assert url.scheme == "https"
        context = ssl.create_default_context(cafile=tmp_path / "cert.pem")
        opened = http.client.HTTPSConnection("127.0.0.1", url.port, context=context)
        with contextlib.closing(opened) as connection:
            connection.request("GET", "/")
            assert connection.getresponse().status == 200


def test_ctrl_c_ends_it(tmp_path):
    with served("--listen", "127.0.0.1:0", folder=tmp_path) as (url, process):
        assert get(url)[0] == 200
        assert process.stop(signal.SIGINT) == 130
        assert "Traceback" not in process.err()
