"""A real daemon on the modem: messages over the air, files that are radios, a PHY too slow."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from sdrlinkd.client import Publisher, Subscriber
from sdrlinkd.family import family
from tests.conftest import ETC
from tests.laws import one_in
from tests.programs import sdrlinkd
from tests.waiting import wait_for

CDR = b"\0\1\0\0"

LOOPBACK = """backend = "loopback"
[link]
pdu_size = 64
[modem]
rate_hz = 2e6
max_cfo_hz = 1e5
[channel]
snr_db = 15.0
clock_ppm = 10.0
"""


def payloads(n):
    return [CDR + i.to_bytes(2, "big") * (20 + 3 * i) for i in range(n)]


def sent_and_heard(node, n):
    """Send `n` messages through the daemon's own air, and get them unchanged and in order."""
    with (
        Subscriber("/rx_robot_1/odom", directory=node.directory) as heard,
        Publisher(node.directory) as out,
    ):
        for payload in payloads(n):
            out.send("/robot_1/odom", payload)
        got = [heard.receive(20) for _ in range(n)]
    assert [message.payload for message in got] == payloads(n)
    return got


@pytest.mark.slow
@pytest.mark.quick
def test_messages_go_over_the_air_unchanged_with_ages_and_snr(start_daemon):
    node = start_daemon(LOOPBACK)
    got = sent_and_heard(node, 40)
    for message in got:
        assert 1_000 < message.age_us < 10_000_000
        assert 12 < message.snr_db < 18
    snapshot = node.snapshot()
    carrier, counters = snapshot.carrier, snapshot.carrier.counters
    assert (carrier.kind, carrier.state) == ("loopback", "up")
    assert "QPSK 1/2, 2 Msps, awgn" in carrier.detail
    assert counters["pdus_bad"] == counters["headers_bad"] == counters["overflows"] == 0
    assert counters["pdus_good"] == snapshot.link.rx.pdus_heard
    wait_for(lambda: (node.snapshot().carrier.realtime_ratio or 0) > 1)
    with node.control() as control:
        assert control.ask("check")["problems"] == []


@pytest.mark.parametrize("grid", one_in(3, ["64/8", "128/16", "256/32"]))
def test_messages_go_over_the_air_on_any_grid_with_a_stronger_preamble(start_daemon, grid):
    keys = f'rate_hz = 2e6\ngrid = "{grid}"\npreamble_boost_db = 3\none_crystal = false'
    node = start_daemon(LOOPBACK.replace("rate_hz = 2e6", keys))
    sent_and_heard(node, 10)


@pytest.mark.long
@pytest.mark.parametrize("factor", [2, 4])
def test_a_radio_may_be_faster_than_the_modem(start_daemon, factor):
    """The noise in the modem's band equals that at the modem's own rate."""
    keys = f"rate_hz = 5e5\noversampling = {factor}"
    node = start_daemon(LOOPBACK.replace("rate_hz = 2e6", keys))
    for message in sent_and_heard(node, 10):
        assert 12 < message.snr_db < 18
    assert f"{factor} times oversampled" in node.snapshot().carrier.detail


def test_stopping_sends_what_is_queued_first(start_daemon):
    node = start_daemon("drain_s = 10.0\n" + LOOPBACK)
    with Publisher(node.directory) as out:
        for payload in payloads(30):
            out.send("/robot_1/odom", payload)
        out.flush()
    assert node.stop(within_s=20) == 0
    assert "out 30/30 sent, 0 queued, 0 dropped" in node.log()


@pytest.mark.long
def test_a_receiver_too_slow_for_its_rate_says_so_and_stays_small(start_daemon):
    # With 4-fold oversampling, even the fastest machine is too slow for this.
    keys = "rate_hz = 2e8\noversampling = 4\nmax_cfo_hz = 1e5\n"
    node = start_daemon(f'backend = "loopback"\n[modem]\n{keys}')
    wait_for(lambda: node.snapshot().carrier.counters["overflows"] > 1, timeout_s=60)
    snapshot = node.snapshot()
    (notice,) = [text for text in snapshot.notices if "fell behind" in text]
    assert "of real time at 200 Msps" in notice
    assert "lower modem.rate_hz" in notice
    counters = snapshot.carrier.counters
    assert counters["gaps"] > 0
    assert counters["samples_lost"] > 1e7
    status = Path(f"/proc/{node.pid}/status").read_text()
    resident_kb = int(re.search(r"VmRSS:\s*(\d+) kB", status)[1])
    assert resident_kb < 1_500_000


def test_a_node_that_only_plays_says_why_nothing_leaves(start_daemon, tmp_path):
    (tmp_path / "noise.cf32").write_bytes(bytes(8 * 200_000))
    node = start_daemon(
        f'backend = "iqfile"\n[iqfile]\nreceive = "{tmp_path}/noise.cf32"\npaced = false\n'
    )
    wait_for(lambda: node.snapshot().carrier.state == "ended")
    snapshot = node.snapshot()
    assert snapshot.carrier.counters["samples"] == 200_000
    assert any("only receives" in text for text in snapshot.notices)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("[modem]\nmcs = 10", "modem.mcs: got 10; allowed: a whole number from 0 to 9"),
        ("[modem]\nrate_hz = 10", "modem.rate_hz: got 10; allowed: a number from"),
        (
            "[modem]\nrate_hz = 2e5\nmax_cfo_hz = 1e5",
            "modem.max_cfo_hz: got 100000; allowed: at most a quarter",
        ),
        ("[modem]\nrate_hz = 1e4\nmcs = 0\nmax_cfo_hz = 0", "raise modem.rate_hz or modem.mcs"),
        ("[link]\npdu_size = 5000", "link.pdu_size: got 5000; allowed"),
        ('[channel]\nprofile = "vacuum"', 'got "vacuum"; allowed: one of "awgn"'),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(write_config, tmp_path, text, says):
    config = write_config(tmp_path, f'backend = "loopback"\n{text}\n')
    with sdrlinkd("--config", config) as daemon:
        assert daemon.wait() == 2
    assert says in daemon.err()
    assert daemon.err().count("\n") == 1


@pytest.mark.slow
def test_a_recording_of_another_rate_is_refused_in_one_line(write_config, tmp_path):
    (tmp_path / "rec.sigmf-data").write_bytes(bytes(100))
    general = {"core:datatype": "ci8", "core:sample_rate": 1e6}
    (tmp_path / "rec.sigmf-meta").write_text(json.dumps({"global": general}))
    config = write_config(tmp_path, 'backend = "iqfile"\n[iqfile]\nreceive = "rec"\n')
    with sdrlinkd("--config", config) as daemon:
        assert daemon.wait() == 2
    *_, last = daemon.err().splitlines()
    assert "sampled at 1e+06 Hz, but the modem is set to 5e+06 Hz" in last
    assert "Traceback" not in daemon.err()


CLASSES = ("urgent", "latency", "default", "bulk")


@pytest.mark.parametrize("paced", one_in(2, [False, True]))
def test_a_recording_ends_with_what_the_daemon_plays_into_it(start_daemon, tmp_path, paced):
    """Unpaced, it would quickly fill the disk."""
    node = start_daemon(
        f'namespace = "robot_1"\nbackend = "iqfile"\n[play]\nduration_s = 0.5\n[modem]\n'
        f'rate_hz = 2e6\n[iqfile]\ntransmit = "{tmp_path}/rec"\npaced = {str(paced).lower()}\n'
        # On a busy machine, the radio's time may run ahead of a daemon that waits for a core.
        + "".join(f"[classes.{each}]\nlifespan_s = inf\n" for each in CLASSES)
    )
    wait_for(lambda: node.snapshot().carrier.state == "ended", timeout_s=60)
    size = (tmp_path / "rec.sigmf-data").stat().st_size
    tx = node.snapshot().link.tx
    assert (tx.accepted, tx.sent, tx.queued) == (50, 50, 0), tx.dropped
    with node.control() as control:
        assert control.ask("check")["problems"] == []
    assert (tmp_path / "rec.sigmf-data").stat().st_size == size
    # Its content can be decoded again.
    other = start_daemon(
        f'namespace = "robot_2"\nbackend = "iqfile"\n[modem]\nrate_hz = 2e6\n'
        f'[iqfile]\nreceive = "{tmp_path}/rec"\npaced = false\nwait_for_consumer = true\n'
    )
    with Subscriber("/rx_robot_1/*", directory=other.directory) as heard:
        assert all(heard.receive(20) is not None for _ in range(50))


def loaded(pid):
    """Compiled packages that a process has loaded."""
    maps = Path(f"/proc/{pid}/maps").read_text()
    return {name for name in ("numpy", "llvmlite", "scipy") if f"/{name}" in maps}


def test_neither_a_daemon_nor_its_modem_loads_a_compiler(start_daemon):
    node = start_daemon('backend = "loopback"\n[modem]\nrate_hz = 1e6\n')
    wait_for(lambda: node.snapshot().carrier.state == "up", 60)
    daemon, modem = family(node.pid)
    assert loaded(daemon) == {"numpy"}
    assert loaded(modem) == {"numpy"}


def test_a_link_works_where_no_memory_may_be_written_and_executed(start_daemon):
    """As in the units; the modem's process inherits it. Linux before 6.3 grants it all the same."""
    node = start_daemon(
        'backend = "loopback"\n[modem]\nrate_hz = 1e6\n',
        before="import ctypes; ctypes.CDLL(None).prctl(65, 1, 0, 0, 0); ",
    )
    wait_for(lambda: node.snapshot().carrier.state == "up", 60)
    with (
        Subscriber("/rx_robot_1/odom", directory=node.directory) as heard,
        Publisher(node.directory) as out,
    ):
        out.send("/robot_1/odom", b"\0\1\0\0odom")
        assert heard.receive(20) is not None


@pytest.mark.slow
def test_a_check_loads_no_compiler(tmp_path):
    done = subprocess.run(
        [
            sys.executable, "-X", "importtime", "-m", "sdrlinkd", "--check",
            "--config", str(ETC / "robot.toml"),
        ],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    imported = {line.rpartition("|")[2].strip() for line in done.stderr.splitlines()}
    assert "phy" in imported
    assert not {each for each in imported if each.split(".")[0] in ("numba", "llvmlite", "scipy")}
    # Nor what computes samples.
    assert "phy.engine" not in imported


def test_a_killed_modem_is_replaced_and_no_message_is_lost_or_sent_twice(start_daemon):
    """All but those on their way; the ledger says which."""
    node = start_daemon('backend = "loopback"\n[modem]\nrate_hz = 1e6\n')
    wait_for(lambda: node.snapshot().carrier.state == "up", 60)
    n = 60
    with (
        Subscriber("/rx_robot_1/odom", directory=node.directory) as heard,
        Publisher(node.directory) as out,
    ):
        for number in range(n):
            out.send("/robot_1/odom", b"\0\1\0\0" + number.to_bytes(4, "big"))
            if number == n // 2:
                os.kill(family(node.pid)[1], signal.SIGKILL)
                wait_for(lambda: node.snapshot().carrier.state == "waiting", 60)
        wait_for(lambda: node.snapshot().carrier.state == "up", 60)
        wait_for(lambda: not node.snapshot().link.tx.queued, 60)
        got = []
        while (message := heard.receive(2)) is not None:
            got.append(int.from_bytes(message.payload[4:8], "big"))
    assert got == sorted(set(got)), "in order, none twice"
    tx = node.snapshot().link.tx
    assert tx.accepted == n
    assert n - len(got) == n - tx.sent == sum(tx.dropped.values())
    assert set(tx.dropped) <= {"tx_radio_failed"}
    assert got[-1] == n - 1
    with node.control() as control:
        assert control.ask("check")["problems"] == []


@pytest.mark.slow
@pytest.mark.parametrize("who", ["daemon", "modem"])
def test_what_outlived_its_lifespan_during_a_stop_is_not_sent(start_daemon, who):
    """Daemon or modem stands still for longer than the messages live."""
    lifespan_s = 0.5
    node = start_daemon(LOOPBACK)
    sent_and_heard(node, 3)
    modem = next(pid for pid in family(node.pid) if pid != node.pid)
    stopped = node.pid if who == "daemon" else modem
    with (
        Subscriber("/rx_robot_1/odom", directory=node.directory, depth=0) as heard,
        Publisher(node.directory) as out,
    ):
        out.wait_for_daemon()
        os.kill(stopped, signal.SIGSTOP)
        for _ in range(300):
            out.send("/robot_1/odom", CDR + bytes(200), lifespan_ms=round(1e3 * lifespan_s))
        time.sleep(3 * lifespan_s)
        os.kill(stopped, signal.SIGCONT)
        last = CDR + b"the last one"
        heard_of_old = 0
        while True:
            out.send("/robot_1/odom", last)
            message = heard.receive(1.0)
            if message is not None and message.payload == last:
                break
            heard_of_old += message is not None
    assert heard_of_old == 0
    assert node.snapshot().link.tx.dropped == {"tx_expired": 300}
    with node.control() as control:
        assert control.ask("check")["problems"] == []
