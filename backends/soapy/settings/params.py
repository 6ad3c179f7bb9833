"""Settings of a device: the section `[soapy]` of the configuration."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

Gain = Annotated[float, Meta(ge=-200, le=200)]
Seconds = Annotated[float, Meta(ge=0, le=10)]


class SoapyParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Settings of a radio behind SoapySDR."""

    device: str = ""
    """The device as SoapySDR's tools name it: `driver=hackrf`, `driver=uhd,serial=…`."""
    tx_enabled: bool = False
    """Allows sending, which also requires a frequency and a gain."""
    tx_gain_db: Gain | None = None
    """Overall TX gain, which the driver distributes over the elements; absent: not set."""
    rx_gain_db: Gain | None = None
    """Overall RX gain; absent: the driver's default."""
    tx_gains: dict[str, Gain] = {}
    """TX gain of each element, by the driver's names."""
    rx_gains: dict[str, Gain] = {}
    """RX gain in dB by element, instead of `rx_gain_db`: `{ LNA = 16, VGA = 20 }`."""
    tx_antenna: str = ""
    """Name of the antenna port that sends; empty: the driver's default."""
    rx_antenna: str = ""
    """Name of the antenna port that receives; empty: the driver's default."""
    channel: Annotated[int, Meta(ge=0, le=15)] = 0
    """Number of the channel, for devices with several."""
    bandwidth_hz: Annotated[float, Meta(ge=0, le=2e8)] = 0.0
    """Bandwidth of the analogue filters; 0: the driver's choice."""
    offset_tuning: Literal["auto", "on", "off"] = "auto"
    """Tune the oscillator a quarter of the radio's rate below the channel's centre.

    "auto": if modem.oversampling makes room for it.
    """
    dc_block: bool = True
    """Remove the DC offset that the oscillator leaves at its frequency."""
    ppm: Annotated[float, Meta(ge=-200, le=200)] = 0.0
    """Correction of the crystal, which the device applies."""
    clock_source: str = ""
    """Reference clock, such as "external" or "gpsdo"; empty: the driver's default."""
    stream_args: dict[str, str] = {}
    """Arguments of its streams, such as `num_recv_frames` of UHD."""
    settings: dict[str, str] = {}
    """Settings that are specific to the driver."""
    lead_s: Annotated[float, Meta(gt=0, le=1)] = 0.02
    """How long before its time a burst is handed over, if the device has time stamps."""
    turnaround_s: Seconds = 0.05
    """Time between receiving and sending, if the device cannot do both at once."""
    transfers_in_flight: Annotated[int, Meta(ge=0, le=64)] | None = None
    """Transfers that the driver accepts ahead of the antenna; absent: from the driver's profile."""
    leading_transfers: Annotated[int, Meta(ge=0, le=16)] = 1
    """Transfers of zeros before the first burst, because the first ones may not be sent whole."""
    listen_s: Seconds = 0.05
    """Minimum time that a half-duplex radio listens before it sends again."""
    longest_tx_s: Annotated[float, Meta(gt=0, le=10)] = 1.0
    """Maximum time that a half-duplex radio sends without listening."""
