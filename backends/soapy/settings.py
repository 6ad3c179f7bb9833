"""What a device is to be set to, and what it then is; goes to the radio process and back."""

from typing import Protocol

import msgspec

from backends.base import Capabilities
from backends.soapy.params import SoapyParams
from backends.soapy.traits import IN_FLIGHT, TxTraits, keeps_time, tx_traits


class SoapySettings(SoapyParams, frozen=True, kw_only=True):
    """What a person sets of a device, and at what rate and frequency (Hz) it runs."""

    rate_hz: float
    frequency_hz: float
    block_s: float = 0.001

    @classmethod
    def of(
        cls, params: SoapyParams, rate_hz: float, frequency_hz: float, block_s: float
    ) -> "SoapySettings":
        """All that is in `params`, for a device at that rate and frequency, in such pieces."""
        given = {name: getattr(params, name) for name in SoapyParams.__struct_fields__}
        return cls(**given, rate_hz=rate_hz, frequency_hz=frequency_hz, block_s=block_s)

    def tx_traits(self, found: "Sending") -> TxTraits:
        """How bursts leave that device."""
        return tx_traits(
            found.has_time, found.full_duplex, found.tx_transfer_s, found.in_flight,
            self.leading_transfers, self.lead_s, self.turnaround_s, self.listen_s,
            self.longest_tx_s,
        )  # fmt: skip

    def capabilities(self, found: "Found") -> Capabilities:
        """What a radio can do that is that device, set so."""
        tx = self.tx_traits(found)
        return Capabilities(
            receives=True,
            transmits=self.tx_enabled,
            full_duplex=found.full_duplex,
            timestamps=found.has_time,
            paced=True,
            lead_s=tx.lead_s,
            turnaround_s=tx.turnaround_s,
            spells=tx.spells,
            index_error_s=0.0 if found.has_time else found.receives_in_s,
            block_s=found.receives_in_s,
        )


class Sending(Protocol):
    """What matters of a device for how bursts leave it."""

    @property
    def has_time(self) -> bool:
        """Whether samples are stamped."""

    @property
    def full_duplex(self) -> bool:
        """Whether it receives while it sends."""

    @property
    def tx_transfer_s(self) -> float:
        """Length of a transfer."""

    @property
    def in_flight(self) -> int:
        """Transfers that are taken ahead."""


class Found(msgspec.Struct, frozen=True, kw_only=True):
    """An open device."""

    driver: str
    hardware: str
    binding: str
    rate_hz: float
    frequency_hz: float
    full_duplex: bool
    has_time: bool
    receives_in_s: float
    """Samples come in pieces of this length."""
    tx_transfer_s: float = 0.0
    in_flight: int = 0
    gains: str = ""

    @property
    def described(self) -> str:
        """For people."""
        parts = [f"{self.driver} {self.hardware}, {self.frequency_hz / 1e6:g} MHz", self.gains]
        return ", ".join(part for part in parts if part)

    @property
    def keeps_time(self) -> bool:
        """Whether bursts leave at times that the device itself keeps."""
        return keeps_time(self.has_time, self.full_duplex)


def in_flight(settings: SoapySettings, driver: str) -> int:
    """Transfers that this driver takes ahead."""
    given = settings.transfers_in_flight
    return IN_FLIGHT.get(driver.lower(), 0) if given is None else given


class SettingError(Exception):
    """Settings that the device does not take; the message cites key, given and allowed."""
