"""The properties of an open device, as the radio process reports them to the daemon."""

import msgspec

from backends.soapy.settings.tx_timing import timestamped_tx


class DeviceInfo(msgspec.Struct, frozen=True, kw_only=True):
    """An open device: its names, its rate and frequency (Hz), and how it moves samples."""

    driver: str
    hardware: str
    binding: str
    rate_hz: float
    frequency_hz: float
    full_duplex: bool
    has_time: bool
    """Whether its samples are stamped by its own clock."""
    receives_in_s: float
    """Length in s of the pieces in which samples come."""
    tx_transfer_s: float = 0.0
    in_flight: int = 0
    gains: str = ""

    @property
    def described(self) -> str:
        """The device in one line for people: driver, hardware, frequency and gains."""
        parts = [f"{self.driver} {self.hardware}, {self.frequency_hz / 1e6:g} MHz", self.gains]
        return ", ".join(part for part in parts if part)

    @property
    def timestamped_tx(self) -> bool:
        """Whether the device itself sends bursts at given times."""
        return timestamped_tx(self.has_time, self.full_duplex)
