"""`doctor`: checks whether this machine can run a node. Needs no daemon."""

import asyncio
import os
import time
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import msgspec
import typer
from rich.console import Console
from rich.table import Table
from rich.text import Text

from sdrlinkd.cli.app import AsJson, RuntimeDir, app, connect
from sdrlinkd.client import NoDaemonError
from sdrlinkd.client import runtime_dir as chosen_dir
from sdrlinkd.errors import UserError

if TYPE_CHECKING:
    from sdrlinkd.config import Setup
    from sdrlinkd.doctor import Finding, HostTerm

MARKS = {"good": ("✓", "green"), "bad": ("✗", "bold red"), "not applicable": ("–", "dim")}
ROOT = Path("/")
MODEM_S = 2.0
WAKES = 1000


@app.command()
def doctor(
    config: Annotated[
        Path | None, typer.Option("--config", help="Configuration that this machine has to run.")
    ] = None,
    runtime_dir: RuntimeDir = None,
    as_json: AsJson = False,
) -> None:
    """Check machine, environment, radio, permissions and clock, and say what to fix.

    Opens the radio, but transmits nothing. Exit code 1 if something needs fixing.
    """
    from sdrlinkd.config import load_config, make_setup

    setup = None
    if config is not None:
        setup = make_setup(load_config(config), config.parent, str(config))
    with Console(stderr=True).status("checking"):
        found, host = _look(setup, runtime_dir)
    is_bad = any(each.state == "bad" for each in found)
    if as_json:
        told = {"ok": not is_bad, "host_s": host.host_s, "findings": found}
        typer.echo(msgspec.json.encode(told).decode())
    else:
        _print(found)
    if is_bad:
        raise typer.Exit(1)


def _look(setup: "Setup | None", runtime_dir: Path | None) -> tuple[list["Finding"], "HostTerm"]:
    from sdrlinkd import doctor as checks
    from sdrlinkd.config import Config, backend_of
    from sdrlinkd.kernelclock import kernel_clock

    config = setup.config if setup is not None else Config()
    radio = backend_of(config)
    device = config.soapy.device if config.backend == "soapy" else ""
    # Read the load before our own checks add to it.
    load, stat = os.getloadavg()[0], _text("proc/stat")
    wall, monotonic = time.time_ns(), time.monotonic_ns()
    headroom = []
    if radio is not None or setup is None:
        headroom = [checks.headroom_found(config.modem, config.link.pdu_size, MODEM_S)]
    host = asyncio.run(checks.measure_host(WAKES))
    step_s = 1e-9 * (time.time_ns() - wall - (time.monotonic_ns() - monotonic))
    given = runtime_dir or config.bus.runtime_dir or os.environ.get("RUNTIME_DIRECTORY") or None
    found = [
        *checks.check_machine(
            os.cpu_count() or 1, load, (stat, _text("proc/stat")), ROOT / "sys/devices/system/cpu",
            is_timed=radio is not None and radio.is_timed,
        ),
        *_environment(),
        checks.check_machine_id(_text("etc/machine-id"), _copies(given)),
        *checks.check_directory(chosen_dir(given), os.getuid()),
        *checks.check_clock(kernel_clock(), step_s, config.chrony.socket),
        *checks.check_limits(checks.granted(), device, ROOT),
        *headroom,
        checks.check_host(host, config.soapy.lead_s if device else None),
    ]  # fmt: skip
    return found + _radio(setup, device), host


def _radio(setup: "Setup | None", device: str) -> list["Finding"]:
    from backends import BackendError, driver_of, probe_devices
    from sdrlinkd.doctor import ON_USB, Finding, State, check_radio, check_usb, is_networked

    config = setup.config if setup is not None else None
    if config is not None and not device:
        return check_radio(config, None)
    try:
        there = probe_devices(device)
    except BackendError as error:
        to_do = "name one device with soapy.device, such as driver=hackrf, and check again"
        return [Finding("device", State.BAD, str(error), to_do)]
    driver = driver_of(device)
    is_on_usb = not driver or (driver in ON_USB and not is_networked(device))
    usb = check_usb(driver, ROOT) if is_on_usb else []
    if any(not each.problem for each in there.devices):
        # The radio works, so unknown USB ids or a missing USB connection do not matter.
        usb = [each for each in usb if each.state is State.GOOD]
    return usb + check_radio(config, there)


def _environment() -> list["Finding"]:
    import phy
    import sdrlinkd
    from phy import engine
    from sdrlinkd.doctor import check_environment

    try:
        requirements = metadata.requires("sdrlinkd") or []
    except metadata.PackageNotFoundError:
        requirements = []
    home, phy_home = (Path(each.__path__[0]).parent for each in (sdrlinkd, phy))
    return check_environment(requirements, metadata.version, home, phy_home, engine.fitting())


def _text(path: str) -> str:
    try:
        return (ROOT / path).read_text().strip()
    except OSError:
        return ""


def _copies(given: "str | Path | None") -> list[int] | None:
    """Robots with this machine's id, as a running daemon has heard them; None: none runs."""
    from sdrlinkd.asking import ask_status

    try:
        with connect(Path(given) if given else None) as control:
            return ask_status(control).link.security.copies
    except (NoDaemonError, UserError):
        return None


def _print(found: list["Finding"]) -> None:
    table = Table(box=None, show_header=False, pad_edge=False)
    table.add_column()
    table.add_column(no_wrap=True)
    table.add_column(overflow="fold")
    n = sum(each.state == "bad" for each in found)
    console = Console(highlight=False)
    console.print(f"{n} to do" if n else "nothing to do")
    for each in sorted(found, key=lambda each: each.state != "bad"):
        mark, style = MARKS[each.state]
        table.add_row(Text(mark, style), Text(each.what), Text(each.told))
        if each.to_do:
            table.add_row("", "", Text(f"→ {each.to_do}"))
    console.print(table)
