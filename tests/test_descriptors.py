"""File descriptors: the limit is raised, and listening ends before they run out."""

import subprocess
import sys

import pytest
import zmq

from sdrlinkd.client import OUT_SOCKET, Publisher, endpoint
from sdrlinkd.descriptors import LEAST, Descriptors
from tests.waiting import wait_for


def test_it_closes_at_nine_tenths_for_a_second_at_least():
    counts, heard, now = [10, 8999, 9000, 9500, 8500, 10], [], [0.0]
    guard = Descriptors(
        10_000, lambda *, is_on: heard.append((is_on, now[0])), lambda: counts[0], lambda: now[0]
    )
    for counts[0], now[0] in ((10, 0), (8999, 1), (9000, 2), (10, 2.5), (9500, 4), (8500, 5)):
        guard.look()
    assert heard == [(False, 2), (True, 5)]
    assert "9000 of the 10000 descriptors were in use" in guard.notices()[0]
    now[0] = 63
    assert guard.notices() == []


def limited(most):
    """Python code that a daemon runs first: it may have so many descriptors."""
    return f"import resource; resource.setrlimit(resource.RLIMIT_NOFILE, ({most}, {most}));"


def test_too_few_are_refused_in_a_line(write_config, tmp_path):
    code = limited(24) + (
        "import sys; from sdrlinkd.__main__ import main; sys.exit(main(sys.argv[1:]))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, "--config", str(write_config(tmp_path))],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert line.startswith(
        "sdrlinkd: descriptors: this process may have 24; allowed: at least 1024"
    )


@pytest.mark.slow
def test_a_crowd_of_silent_programs_ends_nothing(start_daemon):
    """They connect until the daemon cuts them off, and again; when they leave, all is well."""
    daemon = start_daemon(before=limited(LEAST))
    context = zmq.Context()
    context.set(zmq.MAX_SOCKETS, 4096)
    try:
        crowd = [context.socket(zmq.SUB) for _ in range(LEAST)]
        for silent in crowd:
            silent.connect(endpoint(daemon.directory, OUT_SOCKET))
        wait_for(lambda: "descriptors were in use" in daemon.log())
    finally:
        context.destroy(linger=0)
    wait_for(daemon.is_up)
    assert any("descriptors were in use" in each for each in daemon.snapshot().notices)
    with Publisher(daemon.directory) as out:
        out.send("/robot_1/odom", b"\0\1\0\0")
        out.flush()
    wait_for(lambda: daemon.snapshot().link.tx.sent == 1)
