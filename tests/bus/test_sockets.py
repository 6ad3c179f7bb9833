"""The runtime directory: it has one daemon, and other sockets stay untouched."""

import os
import socket
import stat

import pytest
import zmq

from sdrlinkd.bus import RuntimeDirectory, is_foreign
from sdrlinkd.errors import BusError


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
