"""Tries what a daemon needs to start, and leaves no trace: folders, keys, ports and recordings."""

import asyncio
import contextlib
import os
from collections.abc import Iterator
from pathlib import Path

from sdrlinkd.adapters import open_bag, unknown_types
from sdrlinkd.bus import check_directory, running_in
from sdrlinkd.config import Config, Setup, located
from sdrlinkd.errors import UserError
from sdrlinkd.keeping import key_state, usable
from sdrlinkd.keyring import load_keys, service_name
from sdrlinkd.pdulink import try_gnuradio

SYSTEM_RUN = Path("/run")


def try_start(setup: Setup, directory: Path) -> list[str]:
    """Lines on what was tried, with sockets in `directory`. Raises UserError for what would fail.

    A daemon that runs there now is no obstacle: it is stopped before another one starts.
    """
    service = service_name(Path(setup.source)) if setup.source else ""
    if service and os.getuid():
        return ["not checked: the service's folders and keys, which root can see"]
    if service and not setup.config.bus.runtime_dir:
        directory = SYSTEM_RUN / service
    try:
        pid = running_in(directory)
        told = [f"a daemon runs in {directory}, process {pid}: ports were not tried"] if pid else []
        if not (pid or service):
            # The folder of a service is made by systemd.
            check_directory(directory)
        told += [f"warning: {warning}" for warning in unknown_types(setup)]
        told += _check_keys(setup)
        _check_recordings(setup.config)
        if not pid:
            _check_ports(setup.config)
    except UserError as error:
        raise type(error)(located(str(error), setup.source)) from None
    return told


def _check_keys(setup: Setup) -> list[str]:
    security = setup.config.security
    if security.mode == "off":
        return []
    state = key_state(setup)
    state.refuse_unwritable()
    with _of("security.keys"):
        keys = load_keys(Path(security.keys))
    loaded = state.load(keys)
    new = [key.kid for key in usable(keys, loaded) if key.fingerprint not in loaded.floors]
    source = f" --config {setup.source}" if setup.source else ""
    return [
        f"warning: key {kid} is not installed on this robot yet: sdrlinkctl key install{source}; "
        "add --new if the robot's id has never sealed with it"
        for kid in new
    ]


def _check_recordings(config: Config) -> None:
    if config.play.duration_s and config.play.bag:
        with _of("play.bag"):
            open_bag(Path(config.play.bag)).close()
    if config.backend != "iqfile":
        return
    params = config.iqfile
    if params.receive and not Path(params.receive).is_file():
        raise UserError(f"iqfile.receive: {params.receive}: no such recording")
    folder = Path(params.transmit).parent
    if params.transmit and not os.access(folder, os.W_OK):
        raise UserError(f"iqfile.transmit: {folder}: this user cannot write there")


@contextlib.contextmanager
def _of(key: str) -> Iterator[None]:
    """Put the key in front of an error on the file that it names."""
    try:
        yield
    except UserError as error:
        raise UserError(f"{key}: {error}") from None


def _check_ports(config: Config) -> None:
    # To connect to a TCP flowgraph would take it from the program that it serves.
    if config.backend == "gnuradio" and config.gnuradio.transport != "tcp":
        asyncio.run(try_gnuradio(config))
