"""What SoapySDR finds on this machine, looked at in a process of its own: drivers may crash."""

import subprocess
import sys

import msgspec

from backends.base import BackendError
from backends.soapy.surface import Range
from backends.soapy.traits import keeps_time

PATIENCE_S = 90.0
"""Some devices load their firmware first."""


class WaySurvey(msgspec.Struct, frozen=True, kw_only=True):
    """One direction of a device."""

    rates_hz: list[Range]
    frequencies_hz: list[Range]
    gain_db: Range
    gains_db: dict[str, Range]
    antennas: list[str]
    formats: list[str]
    transfer: int
    """Samples of one transfer."""


class DeviceSurvey(msgspec.Struct, frozen=True, kw_only=True):
    """One device; where it could not be opened, `problem` says why."""

    device: str
    """As soapy.device names it."""
    label: str = ""
    driver: str = ""
    hardware: str = ""
    full_duplex: bool = False
    has_time: bool = False
    clock_sources: list[str] = []
    rx: WaySurvey | None = None
    tx: WaySurvey | None = None
    problem: str = ""

    @property
    def keeps_time(self) -> bool:
        """Whether bursts leave at times that the device itself keeps."""
        return keeps_time(self.has_time, self.full_duplex)


class Survey(msgspec.Struct, frozen=True, kw_only=True):
    """All devices, or those that were asked for."""

    binding: str
    modules: list[str]
    devices: list[DeviceSurvey]
    notes: list[str] = []


def survey(args: str = "") -> Survey:
    """Look at the devices that `args` names; "": all. Raises BackendError."""
    try:
        done = subprocess.run(
            [sys.executable, "-m", "backends.soapy.looking", args],
            capture_output=True,
            check=False,
            timeout=PATIENCE_S,
        )
    except subprocess.TimeoutExpired:
        raise BackendError(
            f"a driver did not answer for {PATIENCE_S:g} s; name one device, such as driver=hackrf"
        ) from None
    if done.returncode:
        said = done.stderr.decode(errors="replace").strip().splitlines()
        how = f"signal {-done.returncode}" if done.returncode < 0 else "; ".join(said[-1:])
        raise BackendError(
            f"a driver crashed ({how}); name one device, such as driver=hackrf, to find which"
        )
    # Drivers print what they like before that.
    return msgspec.json.decode(done.stdout.splitlines()[-1], type=Survey)
