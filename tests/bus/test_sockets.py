"""The runtime directory: it has one daemon, and other sockets stay untouched."""

import os
import socket
import stat

import pytest
import zmq

from sdrlinkd.bus import RuntimeDirectory, is_foreign
from sdrlinkd.errors import BusError
from tests.waiting import wait_for


@pytest.fixture
def context():
    context = zmq.Context()
    yield context
    context.destroy(linger=0)


def test_a_second_instance_is_refused_and_the_first_unharmed(tmp_path):
    first = RuntimeDirectory(tmp_path)
    with pytest.raises(BusError, match=f"pid {os.getpid()}"):
        RuntimeDirectory(tmp_path)
    first.close()
    RuntimeDirectory(tmp_path).close()


def test_a_socket_of_another_program_is_neither_stolen_nor_removed(tmp_path, context):
    with socket.socket(socket.AF_UNIX) as other:
        other.bind(os.fspath(tmp_path / "in.sock"))
        other.listen()
        directory = RuntimeDirectory(tmp_path)
        with pytest.raises(BusError, match="in use by another program"):
            directory.bind(context, zmq.PULL, "in.sock", {})
        directory.close()
        assert (tmp_path / "in.sock").exists()


def test_a_stale_socket_file_is_replaced(tmp_path, context):
    with socket.socket(socket.AF_UNIX) as dead:
        dead.bind(os.fspath(tmp_path / "in.sock"))
    directory = RuntimeDirectory(tmp_path)
    directory.bind(context, zmq.PULL, "in.sock", {}).close()
    directory.close()
    assert not (tmp_path / "in.sock").exists()


def test_others_cannot_connect(tmp_path, context):
    directory = RuntimeDirectory(tmp_path / "new")
    bound = directory.bind(context, zmq.PULL, "in.sock", {})
    assert stat.S_IMODE((tmp_path / "new").stat().st_mode) & 0o007 == 0
    assert stat.S_IMODE((tmp_path / "new" / "in.sock").stat().st_mode) & 0o007 == 0
    bound.close()
    directory.close()


def test_a_directory_that_others_may_write_to_is_refused(tmp_path):
    """They could have prepared it."""
    tmp_path.chmod(0o777)
    with pytest.raises(BusError, match="open to all"):
        RuntimeDirectory(tmp_path)
    tmp_path.chmod(0o755)
    RuntimeDirectory(tmp_path).close()


@pytest.mark.parametrize(
    ("owner", "mode", "is_so"),
    [(5, 0o755, False), (0, 0o755, False), (6, 0o755, True), (5, 0o757, True), (0, 0o777, True)],
)
def test_what_others_own_or_may_write_to_is_foreign(owner, mode, is_so):
    about = os.stat_result((stat.S_IFDIR | mode, 0, 0, 1, owner, owner, 0, 0, 0, 0))
    assert is_foreign(about, 5) is is_so


def test_at_the_end_nothing_waits_and_what_is_gone_is_no_matter(tmp_path, context):
    directory = RuntimeDirectory(tmp_path)
    bound = directory.bind(context, zmq.PUSH, "in.sock", {})
    assert bound.linger == 0
    bound.close()
    (tmp_path / "in.sock").unlink(missing_ok=True)
    directory.close()
    RuntimeDirectory(tmp_path).close()


def test_a_path_that_is_too_long_or_no_directory_is_named(tmp_path):
    with pytest.raises(BusError, match="allows 95"):
        RuntimeDirectory(tmp_path / ("x" * 100))
    (tmp_path / "file").write_text("")
    with pytest.raises(BusError, match="is unusable"):
        RuntimeDirectory(tmp_path / "file")


def mode(path):
    return stat.S_IMODE(path.stat().st_mode)


def is_live(path):
    with socket.socket(socket.AF_UNIX) as probe:
        return probe.connect_ex(os.fspath(path)) == 0


def test_a_socket_is_bound_again_as_it_was(tmp_path, context):
    before = os.umask(0o022)
    try:
        directory = RuntimeDirectory(tmp_path)
        bound = directory.bind(context, zmq.PULL, "in.sock", {zmq.RCVHWM: 7})
        assert bound.rcvhwm == 7
        directory.unbind(bound, "in.sock")
        wait_for(lambda: not is_live(tmp_path / "in.sock"))
        directory.bind_again(bound, "in.sock")
        assert is_live(tmp_path / "in.sock")
        assert mode(tmp_path / "in.sock") & 0o007 == 0
        with pytest.raises(BusError, match=r"nowhere/in\.sock cannot be bound"):
            directory.bind_again(bound, "nowhere/in.sock")
        with pytest.raises(BusError, match=r"nowhere/x\.sock cannot be bound"):
            directory.bind(context, zmq.PULL, "nowhere/x.sock", {})
        assert os.umask(0o022) == 0o022, "files of others are made as before"
        bound.close()
        directory.close()
    finally:
        os.umask(before)


def test_the_lock_has_the_pid_as_long_as_the_daemon_runs(tmp_path):
    (tmp_path / "lock").write_text("999999999 of a daemon that was killed")
    directory = RuntimeDirectory(tmp_path)
    assert (tmp_path / "lock").read_text() == f"{os.getpid()}\n"
    directory.close()
    assert (tmp_path / "lock").read_text() == ""


def test_a_path_may_have_95_octets_and_a_link_of_ours_is_followed(tmp_path):
    room = 95 - len(os.fsencode(tmp_path)) - 1
    (tmp_path / "here").symlink_to(tmp_path)
    if room > 5:
        RuntimeDirectory(tmp_path / ("x" * room)).close()
        with pytest.raises(BusError, match="has 96 bytes"):
            RuntimeDirectory(tmp_path / ("x" * (room + 1)))
    RuntimeDirectory(tmp_path / "here").close()
