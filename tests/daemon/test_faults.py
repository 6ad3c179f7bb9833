"""Real daemons with faults around them: the ledger adds up, others lose nothing."""

import os
import signal
import sys
import textwrap
import threading
import time
from itertools import pairwise

import pytest
import zmq

from sdrlinkd.client import Publisher, RefusedError, Subscriber
from sdrlinkd.process import Process, wait_until
from tests.laws import one_in
from tests.programs import sdrlinkctl, sdrlinkd
from tests.waiting import wait_for

CDR = b"\0\1\0\0"


def spawn(code, directory):
    """Run a Python program for the daemon in `directory`; it prints a line when it is ready."""
    environment = {**os.environ, "SDRLINKD_RUNTIME_DIR": str(directory)}
    return Process([sys.executable, "-c", textwrap.dedent(code)], environment=environment)


def problems(daemon):
    with daemon.control() as control:
        return control.ask("check")["problems"]


@pytest.mark.slow
@pytest.mark.quick
def test_message_out_message_in_and_the_snapshot_tells(start_daemon):
    daemon = start_daemon()
    payload = CDR + os.urandom(720)
    with Subscriber(directory=daemon.directory) as heard, Publisher(daemon.directory) as out:
        out.send("/robot_1/odom", payload, qos="latency", priority=90, type="nav_msgs/msg/Odometry")
        message = heard.receive(5)
    assert message.topic == "/rx_robot_1/odom"
    assert message.payload == payload
    assert message.type == "nav_msgs/msg/Odometry"
    assert (message.source, message.number, message.lost_pdus) == (1, 1, 0)
    assert 0 <= message.age_us < 5_000_000
    snapshot = daemon.snapshot()
    assert snapshot.link.tx.sent == snapshot.link.rx.delivered == 1
    assert snapshot.link.neighbors[0].registry == "same"
    assert problems(daemon) == []


def test_malformed_messages_are_counted_and_the_next_one_works(start_daemon):
    daemon = start_daemon()
    context = zmq.Context()
    with context.socket(zmq.PUSH) as push, Subscriber(directory=daemon.directory) as heard:
        push.connect(f"ipc://{daemon.directory}/in.sock")
        for frames in (
            [b"x"],
            [b"/robot_1/odom", b"{}", CDR],
            [b"/robot_1/odom\0", b"\x09", CDR],
            [b"/robot_1/odom\0", b"{}", b"abc"],
            [b"/robot_1/odom\0", b'{"ty": "std_msgs/msg/String"}', CDR],
            [b"/robot_1/nothing\0", b"{}", CDR],
            [b"/robot_1/odom\0", b"{}", CDR + bytes(1 << 20)],
            [b"/robot_1/odom\0", b"{}", CDR + bytes(300_000)],
            [b"/robot_1/odom\0", b"{}", CDR + b"good"],
        ):
            push.send_multipart(frames)
        assert heard.receive(5).payload == CDR + b"good"
    context.term()
    tx = daemon.snapshot().link.tx
    assert tx.dropped == {"tx_bad_envelope": 5, "tx_unknown_topic": 1, "tx_too_big": 2}
    assert tx.accepted == 9
    assert tx.sent == 1
    assert problems(daemon) == []


@pytest.mark.slow
def test_a_producer_killed_in_mid_message_harms_nobody(start_daemon):
    daemon = start_daemon("[link]\npdu_size = 64\n[direct]\nrate_bit_s = 2e6\n")
    flood = """
        from sdrlinkd.client import Publisher
        out = Publisher()
        payload = bytes([0, 1, 0, 0]) + b"k" * 9000
        print("ready", flush=True)
        while True:
            out.send("/robot_1/scan", payload, qos="bulk")
    """
    with Subscriber("/rx_robot_1/*", directory=daemon.directory, depth=0) as heard:
        for round_ in range(5):
            with spawn(flood, daemon.directory) as producer:
                producer.line()
                with Publisher(daemon.directory) as out:
                    out.send("/robot_1/odom", CDR + bytes([round_]), qos="urgent")
                enough = 50 * (round_ + 1)
                wait_for(lambda enough=enough: daemon.snapshot().link.tx.accepted > enough)
                producer.kill()
            assert problems(daemon) == []
        got = []
        while len([m for m in got if m.topic.endswith("odom")]) < 5:
            got.append(heard.receive(10))
        torn = [m for m in got if m.topic.endswith("scan") and m.payload != CDR + b"k" * 9000]
        assert not torn
        assert [m.payload[-1] for m in got if m.topic.endswith("odom")] == list(range(5))


@pytest.mark.slow
def test_a_frozen_consumer_sees_its_own_gap_and_others_lose_nothing(start_daemon):
    daemon = start_daemon()
    count = 3000
    code = """
        from sdrlinkd.client import Subscriber
        with Subscriber("/rx_robot_1/odom", depth=50) as heard:
            print("ready", flush=True)
            for message in heard:
                print(message.number, flush=True)
    """
    with spawn(code, daemon.directory) as frozen:
        assert frozen.line() == "ready"
        frozen.send_signal(signal.SIGSTOP)
        healthy_numbers = []
        with Subscriber("/rx_robot_1/odom", directory=daemon.directory, depth=0) as healthy:

            def take():
                while len(healthy_numbers) < count and (message := healthy.receive(10)):
                    healthy_numbers.append(message.number)

            taker = threading.Thread(target=take)
            taker.start()
            with Publisher(daemon.directory) as out:
                for i in range(count):
                    out.send("/robot_1/odom", CDR + bytes(900))
                    if i % 20 == 19:
                        wait_for(lambda i=i: len(healthy_numbers) > i - 40)
            taker.join()
        assert healthy_numbers == list(range(1, count + 1))
        assert problems(daemon) == []
        frozen.send_signal(signal.SIGCONT)
        with Publisher(daemon.directory) as out:
            numbers = [0]
            while numbers[-1] < count:
                out.send("/robot_1/odom", CDR)
                numbers.append(int(frozen.line()))
        frozen.kill()
    steps = [b - a for a, b in pairwise(numbers)]
    assert min(steps) == 1
    assert max(steps) > 1, "the frozen consumer must see its own gap"


def test_the_ledger_holds_at_any_moment_of_an_overload(start_daemon):
    daemon = start_daemon(
        "[queue]\nmax_messages = 50\n[link]\npdu_size = 64\n[direct]\nrate_bit_s = 1e6\n"
        "loss = 0.05\nduplicate = 0.05\ncorrupt = 0.05\njitter_s = 0.01\n"
    )
    with Publisher(daemon.directory) as out:
        for i in range(40):
            for _ in range(25):
                out.send("/robot_1/scan", CDR + bytes(700), qos="bulk")
            out.send("/robot_1/odom", CDR + bytes([i]), qos="urgent")
            assert problems(daemon) == []
            tx = daemon.snapshot().link.tx
            assert tx.accepted == tx.sent + tx.queued + tx.in_flight + sum(tx.dropped.values())
    tx = daemon.snapshot().link.tx
    assert tx.dropped["tx_overflow_old"] + tx.dropped.get("tx_overflow_new", 0) > 100
    urgent = next(t for t in daemon.snapshot().link.topics if t.name == "/robot_1/odom")
    assert urgent.dropped == {}


def test_sigterm_drains_the_queue_and_names_what_is_left(start_daemon):
    daemon = start_daemon("drain_s = 0.2\n[link]\npdu_size = 64\n[direct]\nrate_bit_s = 1e5\n")
    with Publisher(daemon.directory) as out:
        for _ in range(200):
            out.send("/robot_1/odom", CDR + bytes(700))
    daemon.send_signal(signal.SIGTERM)
    assert daemon.wait(5) == 0
    assert "dropped" in daemon.log()
    assert "ledger:" not in daemon.log()
    assert not list(daemon.directory.glob("*.sock"))


def test_what_has_arrived_before_sigterm_is_in_the_ledger(start_daemon):
    daemon = start_daemon("drain_s = 0\n[link]\npdu_size = 64\n[direct]\nrate_bit_s = 1e5\n")
    context = zmq.Context()
    with context.socket(zmq.PUSH) as push:
        push.connect(f"ipc://{daemon.directory}/in.sock")
        push.send_multipart([b"/robot_1/odom\0", b"{}", CDR])
        wait_for(lambda: daemon.snapshot().link.tx.accepted == 1)
        daemon.send_signal(signal.SIGSTOP)
        for _ in range(299):
            push.send_multipart([b"/robot_1/odom\0", b"{}", CDR + bytes(100)])
        # ZeroMQ's own thread writes the pipe; its content when the daemon wakes counts.
        time.sleep(0.3)
        daemon.send_signal(signal.SIGTERM)
        daemon.send_signal(signal.SIGCONT)
        assert daemon.wait(10) == 0
    context.destroy(linger=0)
    assert "/300 sent" in daemon.log()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "link"),
    one_in(3, [(signal.SIGINT, "ofdm"), (signal.SIGTERM, "direct"), (signal.SIGHUP, "direct")]),
)
def test_a_demo_that_is_ended_leaves_nothing_behind(tmp_path, number, link):
    environment = {**os.environ, "TMPDIR": str(tmp_path)}
    arguments = ("demo", "--link", link, "--out", tmp_path / "out")
    with sdrlinkctl(*arguments, environment=environment) as demo:
        wait_until(lambda: list(tmp_path.glob("sdrlink-*/*/ctl.sock")), 60, demo)
        assert demo.stop(number, 60) != 0
    assert "Traceback" not in demo.err()
    assert not list(tmp_path.glob("sdrlink-*"))


def test_a_second_instance_exits_with_2_and_the_first_is_unharmed(start_daemon):
    daemon = start_daemon()
    with sdrlinkd("--config", daemon.config) as second:
        assert second.wait() == 2
    assert f"pid {daemon.pid}" in second.err()
    assert "Traceback" not in second.err()
    assert daemon.snapshot().state == "running"


@pytest.mark.slow
@pytest.mark.parametrize("name", ["in.sock", "in-pub.sock", "out.sock", "ctl.sock"])
def test_an_occupied_socket_is_named_and_left_alone(tmp_path, name, write_config):
    context = zmq.Context()
    with context.socket(zmq.PULL) as other:
        other.bind(f"ipc://{tmp_path}/{name}")
        config = write_config(tmp_path)
        with sdrlinkd("--config", config) as refused:
            assert refused.wait() == 2
        assert f"{name} is in use by another program" in refused.err()
        assert "Traceback" not in refused.err()
        assert (tmp_path / name).exists()
    context.term()


def test_sighup_rereads_policies_and_keeps_the_old_on_error(start_daemon):
    daemon = start_daemon("[topic.map]\nqos = 'bulk'\n")
    text = daemon.config.read_text()

    def qos():
        return next(t.qos for t in daemon.snapshot().link.topics if t.name == "/robot_1/odom")

    assert qos() == "latency", "by its type"
    daemon.config.write_text(text + '[topic.odom]\nqos = "urgent"\n')
    daemon.send_signal(signal.SIGHUP)
    wait_for(lambda: qos() == "urgent")
    daemon.config.write_text(text + '[topic.odom]\nqos = "fastest"\n')
    daemon.send_signal(signal.SIGHUP)
    wait_for(lambda: "not reloaded" in daemon.log())
    assert qos() == "urgent"
    with daemon.control() as control, pytest.raises(RefusedError, match="fastest"):
        control.ask("reload")


def test_a_changed_registry_is_not_reloaded(start_daemon, tmp_path):
    registry = tmp_path / "own.csv"
    registry.write_text("odom,nav_msgs/Odometry\n")
    daemon = start_daemon(f'registry = "{registry}"\n')
    registry.write_text("imu,sensor_msgs/Imu\nodom,nav_msgs/Odometry\n")
    with daemon.control() as control, pytest.raises(RefusedError, match="restart"):
        control.ask("reload")


def test_control_refuses_in_words(start_daemon):
    daemon = start_daemon()
    with daemon.control() as control:
        with pytest.raises(RefusedError, match="allowed: hello, status"):
            control.ask("explode")
        assert control.ask("hello")["node"] == 1
        assert control.ask("config")["link"]["pdu_size"] == 1024
    context = zmq.Context()
    with context.socket(zmq.DEALER) as dealer:
        dealer.connect(f"ipc://{daemon.directory}/ctl.sock")
        for frames, code in (
            ([b"sdrl1", b"1", b"status"], b"bad_request"),
            ([b"sdrl9", b"1", b"status", b""], b"bad_version"),
            ([b"sdrl1", b"1", b"status", b"\xc1"], b"bad_request"),
            ([b"sdrl1", b"1", b"status", b"\x81\xa1\xe7\x01"], b"bad_request"),
            ([b"sdrl1", b"1", b"status", b"\x81\xa1a" + b"\x91" * 100_000], b"bad_request"),
        ):
            dealer.send_multipart(frames)
            assert dealer.poll(5000)
            assert code in dealer.recv_multipart()[3]
    context.term()
    assert daemon.snapshot().state == "running"


@pytest.mark.slow
def test_config_check_prints_what_follows(write_config, tmp_path):
    config = write_config(tmp_path)
    with sdrlinkd("--check", "--config", config) as checked:
        assert checked.wait() == 0
    assert "/robot_1/odom" in checked.out()
    config.write_text("[link]\npdu_size = 7\n")
    with sdrlinkd("--check", "--config", config) as refused:
        assert refused.wait() == 2
    assert refused.err().count("\n") == 1
    assert "link.pdu_size: got 7; allowed: a whole number from 32 to 2047" in refused.err()
