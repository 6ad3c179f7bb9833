"""What a person sets of a device: the section `[soapy]` of a configuration."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

Gain = Annotated[float, Meta(ge=-200, le=200)]
Seconds = Annotated[float, Meta(ge=0, le=10)]


class SoapyParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What a person sets of a radio behind SoapySDR."""

    device: str = ""
    """As SoapySDR's tools name it: `driver=hackrf`, `driver=uhd,serial=…`."""
    tx_enabled: bool = False
    """Nothing is sent before this is true, and frequency and gain are set."""
    tx_gain_db: Gain | None = None
    """All elements together, as the driver spreads it; absent: not set."""
    rx_gain_db: Gain | None = None
    """Absent: as the driver has it."""
    tx_gains: dict[str, Gain] = {}
    """Gains for sending by element, as the driver names them."""
    rx_gains: dict[str, Gain] = {}
    tx_antenna: str = ""
    rx_antenna: str = ""
    channel: Annotated[int, Meta(ge=0, le=15)] = 0
    bandwidth_hz: Annotated[float, Meta(ge=0, le=2e8)] = 0.0
    """Of the analogue filters; 0: as the driver chooses."""
    offset_tuning: Literal["auto", "on", "off"] = "auto"
    """The oscillator beside the channel, a quarter of the radio's rate below its middle; auto: with
    modem.oversampling, which makes room for it."""
    dc_block: bool = True
    """Take away what the oscillator leaves at its frequency."""
    ppm: Annotated[float, Meta(ge=-200, le=200)] = 0.0
    """Correction of the crystal, by the device."""
    clock_source: str = ""
    stream_args: dict[str, str] = {}
    """Arguments of its streams, such as `num_recv_frames` of UHD."""
    settings: dict[str, str] = {}
    """Settings that only the driver knows."""
    lead_s: Annotated[float, Meta(gt=0, le=1)] = 0.02
    """Bursts are handed over so long before their time, where the device keeps time."""
    turnaround_s: Seconds = 0.05
    """Between receiving and sending, where it cannot do both."""
    transfers_in_flight: Annotated[int, Meta(ge=0, le=64)] | None = None
    """Transfers that the driver takes ahead of the antenna; absent: as is known of it."""
    leading_transfers: Annotated[int, Meta(ge=0, le=16)] = 1
    """Zeros before the first burst, where the first transfers do not get out whole."""
    listen_s: Seconds = 0.05
    """A half-duplex radio listens so long before it sends again."""
    longest_tx_s: Annotated[float, Meta(gt=0, le=10)] = 1.0
    """So long it sends without listening."""
