"""A device's complete settings: the user's, and the modem's rate and frequency."""

from backends.base import Capabilities
from backends.soapy.settings.device_info import DeviceInfo
from backends.soapy.settings.driver_profiles import profile_of
from backends.soapy.settings.params import SoapyParams
from backends.soapy.settings.tx_timing import TxHardware, TxTiming, timing_of


class SettingError(Exception):
    """The device rejects its settings; the message cites key, given and allowed."""


class SoapySettings(SoapyParams, frozen=True, kw_only=True):
    """The user's settings of a device, and its rate and frequency (Hz)."""

    rate_hz: float
    frequency_hz: float
    block_s: float = 0.001

    @classmethod
    def of(
        cls, params: SoapyParams, rate_hz: float, frequency_hz: float, block_s: float
    ) -> "SoapySettings":
        """Combine `params` with a rate, a frequency, and the length of a block."""
        given = {name: getattr(params, name) for name in SoapyParams.__struct_fields__}
        return cls(**given, rate_hz=rate_hz, frequency_hz=frequency_hz, block_s=block_s)

    def tx_timing(self, hardware: TxHardware) -> TxTiming:
        """Timing of bursts on a device with the properties of `hardware` and these settings."""
        return timing_of(
            hardware, self.leading_transfers, self.lead_s, self.turnaround_s, self.listen_s,
            self.longest_tx_s,
        )  # fmt: skip

    def capabilities(self, found: DeviceInfo) -> Capabilities:
        """What a radio on the device `found` can do with these settings."""
        tx = self.tx_timing(found)
        return Capabilities(
            receives=True,
            transmits=self.tx_enabled,
            full_duplex=found.full_duplex,
            timestamps=found.has_time,
            paced=True,
            lead_s=tx.lead_s,
            turnaround_s=tx.turnaround_s,
            tx_windows=tx.tx_windows,
            index_error_s=0.0 if found.has_time else found.receives_in_s,
            block_s=found.receives_in_s,
        )


def in_flight(settings: SoapyParams, driver: str) -> int:
    """Transfers that the driver accepts ahead of the antenna, from the settings or its profile."""
    given = settings.transfers_in_flight
    return profile_of(driver).in_flight if given is None else given
