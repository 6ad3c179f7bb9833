"""The client refuses what the daemon would refuse: at once, by the daemon's current rules."""

import asyncio

import msgspec
import pytest
import zmq

from sdrlinkd.client import (
    ENVELOPE_VERSION,
    AsyncPublisher,
    MessageRefusedError,
    NoDaemonError,
    Publisher,
    Subscriber,
    pack_map,
)
from sdrlinkd.client.testing import CONSTANTS, new_ack_topic
from tests.conftest import ETC
from tests.waiting import wait_for

CDR = b"\0\1\0\0"
ODOM = "/robot_1/odom"
TYPE = "nav_msgs/msg/Odometry"
PDU_SIZE = "link.pdu_size = 1024 (with 2047: 518670 B)"
ALLOWED = (
    "allowed: /robot_1/scan, /robot_1/odom, /robot_1/imu, /robot_1/cmd_vel, /robot_1/map, "
    "/robot_1/clock"
)
WISHES = [
    ({"qos": "fast"}, 'qos: got "fast"; allowed: bulk, default, latency, urgent'),
    ({"qos": 3}, "qos: got 3; allowed: bulk, default, latency, urgent"),
    ({"priority": 128}, "priority: got 128; allowed: 0 to 127 (most urgent)"),
    ({"priority": -1}, "priority: got -1; allowed: 0 to 127 (most urgent)"),
    ({"priority": "high"}, 'priority: got "high"; allowed: 0 to 127 (most urgent)'),
    ({"priority": True}, "priority: got True; allowed: 0 to 127 (most urgent)"),
    ({"dst": 256}, "dst: got 256; allowed: a robot's id, 0 to 254, or 255 for all"),
    ({"lifespan_ms": 0}, "lifespan_ms: got 0; allowed: a number above 0"),
    ({"lifespan_ms": float("nan")}, "lifespan_ms: got nan; allowed: a number above 0"),
    ({"lifespan_ms": "2s"}, 'lifespan_ms: got "2s"; allowed: a number above 0'),
    ({"published_ns": -5}, "published_ns: got -5; allowed: nanoseconds since 1970"),
    ({"published_ns": 1.5}, "published_ns: got 1.5; allowed: nanoseconds since 1970"),
]
MOST = 8 << 20
MESSAGES = [
    ("/robot_9/odom", CDR, {}, "tx_unknown_topic",
     f'topic: got "/robot_9/odom"; did you mean {ODOM}? {ALLOWED}'),
    ("robot_1/scan", CDR, {}, "tx_unknown_topic",
     f'topic: got "robot_1/scan"; did you mean /robot_1/scan? {ALLOWED}'),
    ("imu", CDR, {}, "tx_unknown_topic",
     f'topic: got "imu"; did you mean /robot_1/imu? {ALLOWED}'),
    ("/x", CDR, {}, "tx_unknown_topic", f'topic: got "/x"; {ALLOWED}'),
    (ODOM, CDR + bytes(8_999_996), {}, "tx_too_big",
     f"{ODOM}: too large: 9000000 B; at most 257805 B with {PDU_SIZE}"),
    (ODOM, b"abc", {}, "tx_bad_envelope",
     f"{ODOM}: too short: 3 B; CDR begins with a header of 4 B"),
    (ODOM, CDR, {"type": "sensor_msgs/msg/Imu"}, "tx_bad_envelope",
     f'type: got "sensor_msgs/msg/Imu"; allowed: {TYPE}, the type of {ODOM} in the registry'),
]  # fmt: skip


def push(directory, *messages):
    """Send raw frames, as any program could."""
    context = zmq.Context()
    with context.socket(zmq.PUSH) as socket:
        socket.connect(f"ipc://{directory}/in.sock")
        for frames in messages:
            socket.send_multipart(frames)
    context.term()


def test_send_refuses_in_the_daemons_words(start_daemon):
    daemon = start_daemon()
    with Publisher(daemon.directory) as out:
        for wishes, says in WISHES:
            with pytest.raises(MessageRefusedError) as refused:
                out.send(ODOM, CDR, **wishes)
            assert str(refused.value) == says
        for topic, payload, wishes, reason, says in MESSAGES:
            with pytest.raises(MessageRefusedError) as refused:
                out.send(topic, payload, **wishes)
            assert (str(refused.value), refused.value.reason) == (says, reason)
        out.send(ODOM, CDR + bytes(257_801))
    assert daemon.snapshot().link.tx.accepted == 1
    # The same mistakes made by a program in another language.
    keys = {"qos": "q", "priority": "p", "dst": "d", "lifespan_ms": "ls", "published_ns": "t"}
    for wishes, says in WISHES:
        if isinstance(wishes.get("published_ns"), int):
            continue  # any integer is one there, and ignored when it makes no sense
        header = {keys[key]: value for key, value in wishes.items()}
        push(daemon.directory, [f"{ODOM}\0".encode(), ENVELOPE_VERSION + pack_map(header), CDR])
        wait_for(lambda says=says: daemon.snapshot().bus.bad_envelope_last == says)
    for topic, payload, wishes, reason, says in MESSAGES:
        if reason == "tx_too_big":
            key = "bus.max_message_bytes = 8388608"
            # A program that sends much more is cut off.
            payload = payload[: MOST + 1000]
            says = f"{ODOM}: too large: {len(payload)} B; at most {MOST} B with {key}"
        header = ENVELOPE_VERSION + pack_map({"ty": wishes.get("type", TYPE)})
        push(daemon.directory, [f"{topic}\0".encode(), header, payload])
        wait_for(lambda says=says: daemon.snapshot().bus.bad_envelope_last == says)


async def test_send_refuses_in_asyncio(daemon):
    async with AsyncPublisher(daemon.directory) as out:
        for wishes, says in WISHES:
            with pytest.raises(MessageRefusedError) as refused:
                await out.send(ODOM, CDR, **wishes)
            assert str(refused.value) == says
        for topic, payload, wishes, reason, says in MESSAGES:
            with pytest.raises(MessageRefusedError) as refused:
                await out.send(topic, payload, **wishes)
            assert (str(refused.value), refused.value.reason) == (says, reason)


def test_every_limit_is_named_by_its_key(start_daemon, tmp_path):
    registry = tmp_path / "own.csv"
    registry.write_text((ETC / "registry.csv").read_text() + "tf,tf2_msgs/TFMessage\n")
    daemon = start_daemon(
        f'registry = "{registry}"\n[link]\npdu_size = 64\n[queue]\nmax_bytes = 9000\n'
        '[topic.odom]\nmax_bytes = 700\n[topic.map]\ncompress = "zstd"\n[tf]\ntopics = ["tf"]\n'
    )  # fmt: skip
    with Publisher(daemon.directory) as out:
        for topic, most, reason, key in (
            (ODOM, 700, "tx_size_cap", "topic.odom.max_bytes = 700"),
            ("/robot_1/scan", 9000, "tx_overflow_new", "queue.max_bytes = 9000"),
            ("/robot_1/map", 8 << 20, "tx_too_big", "bus.max_message_bytes = 8388608"),
            ("/robot_1/tf", 8 << 20, "tx_too_big", "bus.max_message_bytes = 8388608"),
        ):
            with pytest.raises(MessageRefusedError) as refused:
                out.send(topic, CDR + bytes(most - 3))
            assert refused.value.reason == reason
            words = f"{topic}: too large: {most + 1} B; at most {most} B with {key}"
            assert str(refused.value) == words
            out.send(topic, CDR + bytes(most - 4))


def test_a_limit_that_changes_while_running_is_known_at_once(start_daemon):
    daemon = start_daemon()
    with Publisher(daemon.directory) as out, daemon.control() as control:
        out.send(ODOM, CDR + bytes(100))
        control.ask("set", {"topic": "odom", "max_bytes": 50})
        # A client that has not queried yet leaves the refusal to the daemon.
        out.flush()
        with pytest.raises(MessageRefusedError, match=r"at most 50 B with topic.odom.max_bytes"):
            out.send(ODOM, CDR + bytes(100))
        control.ask("reload")
        out.send(ODOM, CDR + bytes(100))
    assert daemon.snapshot().link.tx.accepted == 2


def registry_of(folder, *names):
    path = folder / "topics.csv"
    path.write_text("".join(f"{name},std_msgs/String\n" for name in names))
    return path


@pytest.fixture(params=["looks", "only asks"])
def looking(request, monkeypatch):
    """A producer that queries the daemon again after a restart, before it refuses."""
    if request.param == "only asks":
        monkeypatch.setattr(*CONSTANTS["look_s"], 1e9)


def test_a_daemon_with_another_registry_is_believed(start_daemon, restart, tmp_path, looking):
    registry = registry_of(tmp_path, "one", "two")
    daemon = start_daemon(f'registry = "{registry}"\n')
    with Publisher(daemon.directory) as out:
        out.send("/robot_1/one", CDR)
        with pytest.raises(MessageRefusedError, match="did you mean /robot_1/two"):
            out.send("/robot_1/twoo", CDR)
        registry_of(tmp_path, "two", "three")
        daemon = restart(daemon)
        out.send("/robot_1/three", CDR)
        with pytest.raises(MessageRefusedError, match=r"/robot_1/two, /robot_1/three$"):
            out.send("/robot_1/one", CDR)
    assert daemon.snapshot().link.tx.accepted == 1


async def test_a_daemon_with_another_registry_is_believed_in_asyncio(
    start_daemon, restart, tmp_path, looking
):
    registry = registry_of(tmp_path, "one", "two")
    daemon = start_daemon(f'registry = "{registry}"\n')
    async with AsyncPublisher(daemon.directory) as out:
        await out.send("/robot_1/one", CDR)
        registry_of(tmp_path, "two", "three")
        daemon = restart(daemon)
        await out.send("/robot_1/three", CDR)
        with pytest.raises(MessageRefusedError, match=r"/robot_1/two, /robot_1/three$"):
            await out.send("/robot_1/one", CDR)
    assert daemon.snapshot().link.tx.accepted == 1


def test_a_message_that_waited_for_a_daemon_is_checked_by_that_one(
    start_daemon, stop, spawn_again, tmp_path
):
    registry = registry_of(tmp_path, "one", "two")
    daemon = start_daemon(f'registry = "{registry}"\n')
    with Publisher(daemon.directory, timeout_s=30) as out:
        out.send("/robot_1/one", CDR)
        registry_of(tmp_path, "two")
        stop(daemon)
        # Now no daemon is running; the next one starts while `send` waits for it.
        again = spawn_again(daemon)
        with pytest.raises(MessageRefusedError, match=r"allowed: /robot_1/two$"):
            out.send("/robot_1/one", CDR)
        wait_for(again.is_up)
    assert again.snapshot().link.tx.accepted == 0


def test_unchecked_leaves_it_to_the_ledger(start_daemon):
    daemon = start_daemon()
    with Publisher(daemon.directory, checked=False) as out:
        out.send("/robot_1/nothing", CDR)
        out.send(ODOM, CDR + bytes(300_000))
        out.send(ODOM, CDR, type="sensor_msgs/msg/Imu")
        with pytest.raises(MessageRefusedError, match="qos"):
            out.send(ODOM, CDR, qos="fast")
    assert daemon.snapshot().link.tx.dropped == {
        "tx_unknown_topic": 1, "tx_too_big": 1, "tx_bad_envelope": 1,
    }  # fmt: skip


def test_never_blocking(start_daemon, stop, spawn_again, tmp_path):
    with Publisher(tmp_path, timeout_s=0) as out, pytest.raises(NoDaemonError):
        out.send(ODOM, CDR)
    daemon = start_daemon()
    with Publisher(daemon.directory, timeout_s=0) as out, Subscriber(
        "/rx_robot_1/odom", runtime_dir=daemon.directory
    ) as heard:  # fmt: skip
        out.wait_for_daemon(20)
        out.send(ODOM, CDR + b"now")
        out.send(ODOM, CDR + b"too", receipt=True)
        assert [heard.receive(10).payload[4:] for _ in range(2)] == [b"now", b"too"]
        with pytest.raises(MessageRefusedError):
            out.send("/robot_1/odo", CDR)
        stop(daemon)
        with pytest.raises(NoDaemonError):
            out.send(ODOM, CDR)
        wait_for(spawn_again(daemon).is_up)

        def sends():
            try:
                return out.send(ODOM, CDR, receipt=True)
            except NoDaemonError:
                return None

        wait_for(sends)


@pytest.mark.parametrize("make", [Publisher, AsyncPublisher])
async def test_a_daemon_that_answers_but_takes_nothing_yet_is_waited_for(daemon, tmp_path, make):
    """The two sockets connect one by one; a program that waited may send without blocking."""

    async def result(value):
        return await value if asyncio.iscoroutine(value) else value

    (tmp_path / "out.sock").symlink_to(daemon.directory / "out.sock")
    out = make(tmp_path)
    try:
        with pytest.raises(NoDaemonError):
            await result(out.wait_for_daemon(0.5))
        (tmp_path / "in.sock").symlink_to(daemon.directory / "in.sock")
        await result(out.wait_for_daemon(20))
        assert await result(out.send(ODOM, CDR, wait=False)) is True
    finally:
        await result(out.close())


async def test_never_blocking_in_asyncio(start_daemon, tmp_path):
    async with AsyncPublisher(tmp_path, timeout_s=0) as out:
        with pytest.raises(NoDaemonError):
            await out.send(ODOM, CDR)
    daemon = start_daemon()
    async with AsyncPublisher(daemon.directory) as out:
        await out.wait_for_daemon(20)
        await asyncio.gather(*(out.send(ODOM, CDR, timeout_s=0) for _ in range(50)))
    assert daemon.snapshot().link.tx.accepted == 50


@pytest.mark.parametrize("make", [Publisher, AsyncPublisher])
def test_runtime_dir_has_one_other_name(tmp_path, make):
    async def opened(**names):
        out = make(**names)
        directory = (out.directory, out.runtime_dir)
        closed = out.close()
        if closed is not None:
            await closed
        return directory

    assert asyncio.run(opened(runtime_dir=tmp_path)) == (tmp_path, tmp_path)
    assert asyncio.run(opened(directory=tmp_path)) == (tmp_path, tmp_path)
    with pytest.raises(TypeError, match="give only runtime_dir"):
        asyncio.run(opened(runtime_dir=tmp_path, directory=tmp_path))


def test_the_announcement_is_what_the_document_says(start_daemon):
    daemon = start_daemon()
    context = zmq.Context()
    with context.socket(zmq.SUB) as sub:
        sub.subscribe(b"\0\x01")
        sub.connect(f"ipc://{daemon.directory}/out.sock")
        (first,) = sub.recv_multipart()
        told = msgspec.msgpack.decode(first[2:])
        # The welcome comes with the connection; subscriptions are active once this is answered.
        sub.subscribe(here := new_ack_topic())
        assert sub.poll(20_000), "the daemon does not answer"
        assert sub.recv_multipart() == [here, first[1:]]
        with daemon.control() as control:
            control.ask("set", {"topic": "odom", "max_bytes": 50})
        (second,) = sub.recv_multipart()
        after = msgspec.msgpack.decode(second[2:])
    context.term()
    assert first[:2] == second[:2] == b"\0\x01"
    assert told["boot"] == after["boot"]
    assert told["topics"] == list(told["takes"])
    assert told["takes"][ODOM] == {
        "ty": TYPE, "most": 257805, "over": "tx_too_big", "key": PDU_SIZE,
    }  # fmt: skip
    assert after["takes"][ODOM]["most"] == 50
