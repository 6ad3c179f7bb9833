"""Foxglove's door: who may see what robots send, and who may command them."""

import contextlib
import socket
import struct
import time
from urllib.parse import urlsplit

import pytest
import websocket

from sdrlinkd.client import Subscriber
from tests.conftest import daemons
from tests.doors.accounts import OTHER_ACCOUNTS, status_for
from tests.doors.sockets import ports
from tests.foxglove.conftest import SETTINGS, bridge_to, url_of
from tests.foxglove.viewer import SUBPROTOCOL, Viewer
from tests.pairs import pair
from tests.waiting import wait_for

TWIST = b"\0\1\0\0" + struct.pack("<6d", 0.5, 0, 0, 0, 0, -1)
FOREIGN = {"Origin": "http://evil.example"}
# Headers of clients without the token; None: those of a program that is no browser.
CLIENTS = {
    "a program": None, "a foreign page": FOREIGN, "a page of no origin": {"Origin": "null"},
    "another name": {"Host": "evil.example:80"},
}  # fmt: skip


class Seen:
    """Robot 1, and a bridge beside robot 2 that may command it."""

    def __init__(self, robots, bridge):
        self.sender, self.seen = robots
        self.url = url_of(bridge)
        self.bridge = bridge
        self.plain = f"ws://{urlsplit(self.url).netloc}"

    @contextlib.contextmanager
    def hearing(self):
        """What robot 1 is commanded: a function that tells whether something comes."""
        topic = "/rx_robot_2/robot_1/cmd_vel"
        with Subscriber(topic, runtime_dir=self.sender.directory) as heard:

            def hears(within_s):
                with contextlib.suppress(TimeoutError):
                    message = heard.receive(within_s)
                    return message is not None and message.payload == TWIST
                return False

            yield hears


@pytest.fixture(scope="module")
def seen(tmp_path_factory):
    with contextlib.ExitStack() as stack:
        start = stack.enter_context(daemons(tmp_path_factory))
        robots = stack.enter_context(pair(start, tmp_path_factory.mktemp("hub"), SETTINGS))
        bridge = stack.enter_context(bridge_to(robots[1], "--publish", "/robot_1/cmd_*"))
        yield Seen(robots, bridge)
        assert "Traceback" not in bridge.log(), bridge.log()


def refusal(url, headers):
    """The status and the words with which a WebSocket is refused; (101, "") if it is not."""
    given = headers or {}
    named = [f"{name}: {value}" for name, value in given.items() if name != "Origin"]
    options = {"suppress_origin": True} if "Origin" not in given else {"origin": given["Origin"]}
    try:
        websocket.create_connection(
            url, header=named, subprotocols=[SUBPROTOCOL], timeout=20, **options
        ).close()
    except websocket.WebSocketBadStatusException as error:
        return error.status_code, error.resp_body.decode()
    return 101, ""


@pytest.mark.slow
def test_without_the_token_nobody_comes_in_where_commands_do(seen):
    for headers in CLIENTS.values():
        for query in ("", "/?token=wrong", "/?token=", "/?token=" + "x" * 9000):
            status, said = refusal(seen.plain + query, headers)
            assert (status, "asks for its token" in said) == (403, True)
    with seen.hearing() as hears, Viewer(seen.url, "/sdrlink/bridge") as viewer:
        viewer.until(lambda: viewer.info)
        viewer.advertise(1, "/robot_1/cmd_vel")

        def heard():
            viewer.publish(1, TWIST)
            return hears(0.3)

        viewer.until(heard)
        counts = viewer.until(lambda: viewer.decoded("/sdrlink/bridge"))
        assert counts[-1]["clients_refused"] >= 4 * len(CLIENTS)


@pytest.mark.slow
def test_the_sdks_own_port_takes_no_commands(seen):
    """Programs of this computer may find it: they see, and command nothing."""
    door = urlsplit(seen.url).port
    (inner,) = {port for _, _, port in ports(seen.bridge.pid)} - {door}
    with seen.hearing() as hears, Viewer(f"ws://127.0.0.1:{inner}") as viewer:
        viewer.until(lambda: viewer.info)
        for number, topic in ((1, "/robot_1/cmd_vel"), ((1 << 32) - 1, "/robot_1/cmd_x")):
            viewer.advertise(number, topic)
            viewer.publish(number, TWIST)
        viewer.until(lambda: any("with the token" in each["message"] for each in viewer.statuses))
        assert not hears(1.0)


@pytest.mark.slow
def test_what_is_no_command_ends_nothing(seen):
    twist = "geometry_msgs/msg/Twist"
    with seen.hearing() as hears, Viewer(seen.url, "/sdrlink/bridge") as viewer:

        def refused():
            return [each["commands_refused"] for each in viewer.decoded("/sdrlink/bridge")][-1:]

        viewer.until(refused)
        viewer.advertise(1, "/robot_1/cmd_vel", twist, "json")
        viewer.advertise(2, "/robot_1/cmd_vel", twist)
        bad = (
            (1, b"[" * 200_000), (1, b"[" * 60_000), (1, b'{"linear":{"x":NaN}}'),
            (1, b'{"linear":{"x":1e999}}'), (2, b"\0\1\0\0\xff"), (2, b""), (2, bytes(70_000)),
            (2, TWIST[:-8] + struct.pack("<d", float("inf"))),
        )  # fmt: skip
        for number, data in bad:
            before = refused()
            viewer.publish(number, data)
            viewer.until(lambda before=before: refused() > before)
        assert not hears(0.5)
        assert seen.bridge.is_running
        wait_for(lambda: viewer.publish(2, TWIST) or hears(0.3))


@pytest.mark.slow
def test_a_bridge_that_only_shows_is_for_its_own_account_and_pages(seen):
    with bridge_to(seen.seen) as bridge:
        url = url_of(bridge)
        assert refusal(url, None) == (101, "")
        for origin in ("https://app.foxglove.dev", "http://localhost:8080"):
            assert refusal(url, {"Origin": origin}) == (101, "")
        for name, words in (("a foreign page", "'http://evil.example'"), ("another name", "name")):
            status, said = refusal(url, CLIENTS[name])
            assert (status, words in said) == (403, True)
        assert refusal(url, CLIENTS["a page of no origin"])[0] == 403
        for account in OTHER_ACCOUNTS:
            assert status_for(account, urlsplit(url).port) == 403
    with bridge_to(seen.seen, "--allow-origin", FOREIGN["Origin"]) as bridge:
        assert refusal(url_of(bridge), FOREIGN) == (101, "")


@pytest.mark.slow
def test_half_open_and_nonsense_leave_room_for_others(seen):
    address = ("127.0.0.1", urlsplit(seen.url).port)
    with contextlib.ExitStack() as stack:
        for data in (b"", b"GET", b"GET / HTTP/1.1\r\n" + b"a: b\r\n" * 5000, b"\0" * 20_000):
            for _ in range(20):
                each = stack.enter_context(socket.create_connection(address))
                with contextlib.suppress(OSError):
                    each.sendall(data)
        time.sleep(0.2)
        wait_for(lambda: refusal(seen.url, None)[0] == 101)
