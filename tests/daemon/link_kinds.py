"""Runs daemons with every kind of link in turn in this process, to see what they compile.

Prints each kernel that was compiled for a new signature after the warm-up; a test runs it.
"""

import contextlib
import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from random import Random

from numba.core.dispatcher import Dispatcher

import phy
from sdrlinkd import spawn
from sdrlinkd.__main__ import main
from sdrlinkd.client import NoDaemonError, Publisher, Subscriber
from sdrlinkd.modem import making
from sdrlinkd.modem.process import Loading, ModemHere, make_radio
from sdrlinkd.process import Process, module
from tests.backends.hubs import serving
from tests.conftest import ETC

FOLDER = Path(sys.argv[1])
N = 12
MODEM = "[link]\npdu_size = 200\n[modem]\nrate_hz = 1e6\nmax_cfo_hz = 5e4\n"
ECHOES = "[channel]\nsnr_db = 30.0\nclock_ppm = 10.0\ndelay_s = 1.3e-6\nrx_image_db = 30.0\n"


def signatures() -> set[tuple[str, str]]:
    """All kernels with their signatures: (kernel, what it is compiled for)."""
    return {
        (f"{name}.{key}", str(signature))
        for name, module in list(sys.modules.items())
        if name.startswith("phy.kernels.")
        for key, kernel in vars(module).items()
        if isinstance(kernel, Dispatcher)
        for signature in kernel.signatures
    }


def run(name: str, toml: str, hears: int = N, hearer: Path | None = None) -> None:
    """Run a daemon that sends `N` messages, until it (or `hearer`) has received `hears` of them."""
    folder = FOLDER / name
    folder.mkdir(exist_ok=True)
    config = folder / "sdrlinkd.toml"
    top, _, tables = toml.partition("[")
    config.write_text(
        f'registry = "{ETC / "registry.csv"}"\nseed = 1\n{top}'
        f'[bus]\nruntime_dir = "{folder}"\n[{tables}'
    )
    problems = []

    def use() -> None:
        try:
            with client(folder, hearer or folder) as (heard, out):
                for i in range(N):
                    out.send("/robot_1/odom", b"\0\1\0\0" + bytes(40 + 97 * i))
                out.flush()
                for i in range(hears):
                    if heard.receive(30) is None:
                        problems.append(f"{name}: only {i} of {hears} messages came")
                        break
        except Exception as error:
            problems.append(f"{name}: {error!r}")
        os.kill(os.getpid(), signal.SIGTERM)

    user = threading.Thread(target=use)
    user.start()
    code = main(["--config", str(config), "--log-level", "warning"])
    user.join()
    if code or problems:
        sys.exit(f"{name}: exit code {code}; {problems}")


@contextlib.contextmanager
def client(folder: Path, hearer: Path) -> Iterator[tuple[Subscriber, Publisher]]:
    """Clients of both daemons, once both are running."""
    deadline = time.monotonic() + 60
    while True:
        try:
            with Subscriber("/*", directory=hearer) as heard, Publisher(folder) as out:
                yield heard, out
                return
        except NoDaemonError:
            if time.monotonic() > deadline:
                raise
            time.sleep(0.02)


def on_ether(robot: int) -> str:
    """Configuration of one of two robots that share the air."""
    return (
        f'namespace = "robot_{robot}"\nbackend = "ether"\n[ether]\ndir = "{FOLDER}/hub"\n'
        '[access]\npolicy = "csma"\nforce = true\n' + MODEM
    )


def two_on_ether() -> None:
    """The other robot has a process of its own, and hears this one."""
    (FOLDER / "hub").mkdir()
    config = FOLDER / "other.toml"
    config.write_text(
        f'registry = "{ETC / "registry.csv"}"\n{on_ether(2)}[bus]\nruntime_dir = "{FOLDER}"\n'
    )
    with (
        serving(FOLDER / "hub", rate_hz=1e6, frequency_hz=2.45e9, block_s=0.001),
        Process(module("sdrlinkd", "--config", config), log=FOLDER / "other.log"),
    ):
        run("ether", on_ether(1), hears=1, hearer=FOLDER)


def here(wanted, listens, began_s, _progress, _early):
    """A modem in this process, where it can be seen what it compiles."""
    config, node_id, seed, longest_s, patience = wanted
    radio = make_radio(config, node_id, Random(seed), longest_s, patience)
    return ModemHere(config.modem, radio, listens, began_s, Loading())


making.ModemProcess = here
spawn.spawn_early = lambda _: spawn.EarlyModem()
phy.warm_up()
before = signatures()
loopback = 'backend = "loopback"\n' + MODEM
run("plain", loopback + "oversampling = 1\n[channel]\nsnr_db = 20.0\nclock_ppm = 10.0\n")
for number, profile in enumerate(phy.PROFILES):
    keys = f"oversampling = {(2, 4)[number % 2]}\nmcs = {number}\n"
    run(profile, f'{loopback}{keys}{ECHOES}profile = "{profile}"\nadc_bits = 10\n', hears=0)
for grid in ("64/8", "128/16", "256/32"):
    run(grid.replace("/", "_"), f'{loopback}mcs = 2\ngrid = "{grid}"\n')
iqfile = 'backend = "iqfile"\n' + MODEM + "[channel]\nsnr_db = 25.0\n[iqfile]\n"
run("write", iqfile + f'transmit = "{FOLDER}/rec"\nformat = "ci8"\n', hears=0)
run("play", iqfile + f'receive = "{FOLDER}/rec"\npaced = false\nwait_for_consumer = true\n')
two_on_ether()
run("direct", 'backend = "direct"\n[link]\n')
for kernel, signature in sorted(signatures() - before):
    sys.stdout.write(f"{kernel} {signature}\n")
