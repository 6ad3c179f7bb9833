"""What a probe found: the library, and the properties of each device."""

import msgspec

from backends.soapy.binding import Range, driver_name
from backends.soapy.settings import timestamped_tx


class DirectionProbe(msgspec.Struct, frozen=True, kw_only=True):
    """What a device offers in one direction, RX or TX, on its first channel."""

    rates_hz: list[Range]
    frequencies_hz: list[Range]
    gain_db: Range
    gains_db: dict[str, Range]
    """Range of each gain element, by name."""
    antennas: list[str]
    formats: list[str]
    transfer: int
    """Number of samples that the driver moves at once."""


class DeviceProbe(msgspec.Struct, frozen=True, kw_only=True):
    """One device; if it could not be opened, `problem` says why."""

    device: str
    """The device, as a value for the key soapy.device."""
    label: str = ""
    driver: str = ""
    hardware: str = ""
    full_duplex: bool = False
    has_time: bool = False
    """Whether its samples are stamped by its own clock."""
    clock_sources: list[str] = []
    rx: DirectionProbe | None = None
    tx: DirectionProbe | None = None
    problem: str = ""

    @property
    def timestamped_tx(self) -> bool:
        """Whether the device itself sends bursts at given times."""
        return timestamped_tx(self.has_time, self.full_duplex)


class ProbeReport(msgspec.Struct, frozen=True, kw_only=True):
    """All devices, or those that match the request."""

    binding: str
    """The binding in use and its version; empty: no SoapySDR."""
    modules: list[str]
    """Paths of the driver modules that were loaded."""
    devices: list[DeviceProbe]
    notes: list[str] = []

    @property
    def drivers(self) -> str:
        """The drivers by name and number, for people: `2 drivers: hackrf, uhd`."""
        names = sorted(map(driver_name, self.modules))
        n = len(names)
        return f"{n} driver{'' if n == 1 else 's'}" + (f": {', '.join(names)}" if names else "")
