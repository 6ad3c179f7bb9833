"""What a probe found: the library, and what each device says of itself."""

import msgspec

from backends.soapy.binding import Range
from backends.soapy.settings import timestamped_tx


class DirectionProbe(msgspec.Struct, frozen=True, kw_only=True):
    """What a device offers in one direction, receiving or sending, on its first channel."""

    rates_hz: list[Range]
    frequencies_hz: list[Range]
    gain_db: Range
    gains_db: dict[str, Range]
    """The range of each gain element by its name."""
    antennas: list[str]
    formats: list[str]
    transfer: int
    """Samples that the driver moves at once."""


class DeviceProbe(msgspec.Struct, frozen=True, kw_only=True):
    """One device; where it could not be opened, `problem` says why."""

    device: str
    """The device as the key soapy.device names it."""
    label: str = ""
    driver: str = ""
    hardware: str = ""
    full_duplex: bool = False
    has_time: bool = False
    """Its samples are stamped by its own clock."""
    clock_sources: list[str] = []
    rx: DirectionProbe | None = None
    tx: DirectionProbe | None = None
    problem: str = ""

    @property
    def timestamped_tx(self) -> bool:
        """Whether bursts leave at times that the device itself keeps."""
        return timestamped_tx(self.has_time, self.full_duplex)


class ProbeReport(msgspec.Struct, frozen=True, kw_only=True):
    """All devices, or those that were asked for."""

    binding: str
    """Which SoapySDR there is, and its version; empty: none."""
    modules: list[str]
    """Files of the driver modules that were loaded."""
    devices: list[DeviceProbe]
    notes: list[str] = []
