"""Two real daemons, robots 1 and 2, on one simulated air with modems."""

import contextlib

from tests.backends.hubs import serving
from tests.waiting import wait_for

AIR = {"rate_hz": 1e6, "frequency_hz": 2.45e9, "block_s": 0.001}


def on_air(hub, robot, more=""):
    """The configuration of a robot on the air of `hub`; `more` is for the top."""
    return (
        f'{more}namespace = "robot_{robot}"\nbackend = "ether"\n'
        f'[ether]\ndir = "{hub}"\n[modem]\nrate_hz = 1e6\n[access]\nnodes = [1, 2]\n'
    )


@contextlib.contextmanager
def pair(start_daemon, hub, more=""):
    """Daemons of robots 1 and 2 that hear each other; `hub` is a folder for the air."""
    with serving(hub, **AIR):
        daemons = [start_daemon(on_air(hub, robot, more)) for robot in (1, 2)]
        for each in daemons:
            wait_for(lambda each=each: bool(each.snapshot().link.neighbors), 60)
        yield daemons
