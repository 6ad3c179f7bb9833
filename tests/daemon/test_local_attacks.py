"""What other programs and users of the computer may try."""

import os
import signal
import socket
import time

import pytest
import zmq

from sdrlinkd.client import IN_SOCKET, ControlClient, NoDaemonError, Publisher, endpoint
from sdrlinkd.client.testing import is_prepared
from tests.programs import sdrlinkd
from tests.waiting import wait_for

CDR = b"\0\1\0\0"


def test_a_message_of_256_mib_never_gets_into_memory(start_daemon):
    daemon = start_daemon()
    context = zmq.Context()
    flood = context.socket(zmq.PUSH)
    flood.connect(endpoint(daemon.directory, IN_SOCKET))
    flood.send_multipart([b"/robot_1/odom\0", b"\x01\x80", bytes(1 << 28)])
    with Publisher(daemon.directory) as out:
        out.send("/robot_1/odom", CDR)
        out.flush()
    wait_for(lambda: daemon.snapshot().link.tx.sent == 1)
    with open(f"/proc/{daemon.pid}/status") as status:  # noqa: PTH123  # of the kernel
        peak_kib = next(int(line.split()[1]) for line in status if line.startswith("VmHWM"))
    context.destroy(linger=0)
    assert peak_kib < 200_000


@pytest.mark.slow
@pytest.mark.parametrize("what", ["lock", "folder"])
def test_no_link_of_another_user_is_followed(write_config, tmp_path, what):
    """A link in place of the lock is refused, whoever made it; its target stays."""
    target = tmp_path / "precious"
    folder = tmp_path / "run"
    if what == "lock":
        target.write_text("precious")
        folder.mkdir()
        (folder / "lock").symlink_to(target)
    else:
        target.mkdir()
        target.chmod(0o777)
        folder.symlink_to(target)
    conf = tmp_path / "conf"
    conf.mkdir()
    path = write_config(conf)
    path.write_text(path.read_text().replace(f'"{conf}"', f'"{folder}"'))
    with sdrlinkd("--config", path) as daemon:
        assert daemon.wait() == 2
    (line,) = daemon.err().splitlines()
    assert line.startswith("sdrlinkd: bus.runtime_dir:")
    if what == "lock":
        assert target.read_text() == "precious"
    else:
        assert list(target.iterdir()) == []


def test_clients_do_not_talk_to_a_folder_that_another_user_prepared(tmp_path, monkeypatch):
    folder = tmp_path / "open" / "sdrlinkd-0"
    folder.mkdir(parents=True)
    folder.parent.chmod(0o1777)
    assert not is_prepared(folder)
    monkeypatch.setattr(os, "getuid", lambda: 12345)
    os.chown(folder, 54321, 54321)
    assert is_prepared(folder)
    (folder / "ctl.sock").touch()
    with pytest.raises(NoDaemonError, match="belongs to another user"):
        ControlClient(folder)
    # Root's folders are as safe as root.
    os.chown(folder, 0, 0)
    assert not is_prepared(folder)


@pytest.mark.slow
@pytest.mark.parametrize("path", ["/dev/zero", "/", "/dev/null/x"])
def test_a_configuration_that_is_none_is_refused_in_a_line(path):
    with sdrlinkd("--config", path) as daemon:
        assert daemon.wait() == 2
    assert len(daemon.err().splitlines()) == 1
    assert path in daemon.err()


def test_sighup_before_it_is_ready_does_not_end_it(start_daemon):
    daemon = start_daemon(
        before="import os, signal; from sdrlinkd import spawn; early = spawn.spawn_early\n"
        "def asked(path): os.kill(os.getpid(), signal.SIGHUP); return early(path)\n"
        "spawn.spawn_early = asked\n"
    )
    daemon.send_signal(signal.SIGHUP)
    wait_for(lambda: "re-read: topic policies" in daemon.log())


def test_what_waited_while_it_was_stopped_is_not_sent_as_new(start_daemon):
    """Messages without a publication time, and with a lifespan, that a stopped daemon found."""
    daemon = start_daemon("[topic.odom]\nlifespan_s = 1.0\n")
    context = zmq.Context()
    out = context.socket(zmq.PUSH)
    out.connect(endpoint(daemon.directory, IN_SOCKET))
    out.send_multipart([b"/robot_1/odom\0", b"\x01\x80", CDR])
    wait_for(lambda: daemon.snapshot().link.tx.sent == 1)
    daemon.send_signal(signal.SIGSTOP)
    for _ in range(20):
        out.send_multipart([b"/robot_1/odom\0", b"\x01\x80", CDR])
    time.sleep(1.5)
    daemon.send_signal(signal.SIGCONT)
    wait_for(lambda: daemon.snapshot().link.tx.accepted == 21)
    assert daemon.snapshot().link.tx.dropped == {"tx_expired": 20}
    context.destroy(linger=0)


def test_datagrams_of_others_are_not_heard(start_daemon):
    """Without `receive`, the kernel lets in the flowgraph's alone."""
    graph, other = (socket.socket(type=socket.SOCK_DGRAM) for _ in range(2))
    for each in (graph, other):
        each.bind(("127.0.0.1", 0))
    graph.settimeout(20)
    daemon = start_daemon(
        'backend = "gnuradio"\n[gnuradio]\ntransport = "udp"\n'
        f'send = "127.0.0.1:{graph.getsockname()[1]}"\nrate_bit_s = 1e6\n[link]\npdu_size = 64\n'
    )
    with Publisher(daemon.directory) as out:
        out.send("/robot_1/odom", CDR)
        out.flush()
    _, peer = graph.recvfrom(2048)
    assert peer[0] == "127.0.0.1"
    for each in (other, graph):
        each.sendto(bytes(64), peer)
        each.sendto(bytes(64), peer)
    wait_for(lambda: daemon.snapshot().link.rx.pdus_heard == 2)
    graph.close()
    other.close()
