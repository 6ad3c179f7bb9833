"""What carries the PDUs: the direct link, the modem, its radios and their simulated air."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

SIMULATED_HZ = 2.45e9
Decibel = Annotated[float, Meta(ge=-300)]


class DirectParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The direct link: PDUs straight back to this daemon, with faults on demand."""

    hear_self: bool = True
    rate_bit_s: Annotated[float, Meta(ge=0, le=1e12)] = 0.0
    """Pace of the link in bit/s; 0: as fast as it goes."""
    loss: Annotated[float, Meta(ge=0, le=1)] = 0.0
    """Share of PDUs that vanish."""
    delay_s: Annotated[float, Meta(ge=0, le=60)] = 0.0
    jitter_s: Annotated[float, Meta(ge=0, le=60)] = 0.0
    """Further delay, uniform from 0; PDUs overtake each other."""
    duplicate: Annotated[float, Meta(ge=0, le=1)] = 0.0
    """Share of PDUs that arrive twice."""
    corrupt: Annotated[float, Meta(ge=0, le=1)] = 0.0
    """Share of PDUs that arrive with a flipped bit."""
    max_pdus_per_burst: Annotated[int, Meta(ge=1, le=63)] = 16


class ModemParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of the OFDM modem, on every radio."""

    rate_hz: Annotated[float, Meta(ge=1e4, le=2e8)] = 5e6
    """Samples a second, and the width of the channel; the same at all nodes."""
    frequency_hz: Annotated[float, Meta(ge=0, le=1e11)] = 0.0
    """Middle of the channel; 0: not set, and simulations take SIMULATED_HZ."""
    mcs: Annotated[int, Meta(ge=0, le=9)] = 1
    """Modulation and code rate; `sdrlinkctl phy info` lists them."""
    grid: Literal["64/16", "64/8", "128/16", "256/32"] = "64/16"
    """FFT size and samples of prefix; the same at all nodes."""
    network: Annotated[int, Meta(ge=0, le=7)] = 0
    """Bursts of other networks are skipped."""
    max_burst_s: Annotated[float, Meta(gt=0, le=1)] = 0.005
    """Longest burst of several PDUs: how long an urgent message may have to wait."""
    tx_lead_s: Annotated[float, Meta(ge=0, le=1)] = 0.005
    """How long before the air is free the next burst is composed: time to compose and modulate it,
    and what an urgent message may have to wait besides a burst."""
    backoff_db: Annotated[float, Meta(ge=0, le=60)] = 12.0
    """Mean power of a burst below full scale: room for its peaks, which are 7 dB (BPSK, QPSK) to
    10 dB (256QAM) over it."""
    preamble_boost_db: Annotated[float, Meta(ge=0, le=3)] = 0.0
    """The preamble is sent so much stronger than the rest: where peaks limit an amplifier, bursts
    are found farther away."""
    max_cfo_hz: Literal["auto"] | Annotated[float, Meta(ge=0, le=1e6)] = "auto"
    """Largest frequency offset between two radios at which bursts are looked for; "auto": what
    `crystal_ppm` makes of it, as far as a receiver can search."""
    crystal_ppm: Annotated[float, Meta(ge=0, le=200)] = 40.0
    """How far every radio's crystal may be off."""
    one_crystal: bool = True
    """Carrier and samples of every radio come from the same crystal: the offset of the one tells
    that of the other."""
    carrier_db: Annotated[float, Meta(ge=3, le=40)] = 6.0
    """Energy above the noise from which on the channel is busy; for access policies that listen."""
    block_s: Annotated[float, Meta(ge=1e-4, le=0.1)] = 0.001
    """Samples are received in pieces of this length."""
    oversampling: Literal[1, 2, 4] = 1
    """The radio runs at so many times `rate_hz`: for those that are not made for slow rates."""

    @property
    def centre_hz(self) -> float:
        """The middle of the channel in Hz; SIMULATED_HZ where none is set."""
        return self.frequency_hz or SIMULATED_HZ

    @property
    def apart_hz(self) -> float:
        """How far apart two radios' centre frequencies may be in Hz, with both crystals at their
        worst.
        """
        return 2e-6 * self.crystal_ppm * self.centre_hz

    @property
    def most_cfo_hz(self) -> float:
        """The largest frequency offset in Hz that a receiver can search at this rate."""
        return self.rate_hz / 4

    @property
    def searched_cfo_hz(self) -> float:
        """The frequency offset in Hz up to which bursts are looked for."""
        if self.max_cfo_hz == "auto":
            return min(self.apart_hz, self.most_cfo_hz)
        return float(self.max_cfo_hz)


class TransformParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What of /tf is sent over a slow link, and how."""

    topics: list[str] = []
    """Registry names of type tf2_msgs/TFMessage, such as tf and tf_static."""
    frames: list[str] = []
    """Child frames to send, * for any text; empty: all."""
    drop: list[str] = []
    """Child frames not to send."""
    prefix: str = ""
    """Put before all frames: two robots' base_link are two frames."""
    shared: list[str] = msgspec.field(default_factory=lambda: ["map", "world", "earth"])
    """Frames that all robots mean alike, without prefix."""
    combine_s: Annotated[float, Meta(ge=0, le=10)] = 0.0
    """Send one message in so long, with the last transform of each frame."""


class PlayParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Messages that the daemon itself sends, by its radio's time: for simulations in lock-step."""

    bag: str = ""
    """Recording to play; empty, with `duration_s`: a built-in robot."""
    duration_s: Annotated[float, Meta(ge=0, le=1e6)] = 0.0
    """How much of the recording is sent; 0: nothing."""
    begin_s: Annotated[float, Meta(ge=0, le=1e6)] = 0.0
    """When the first message is sent."""
    wait_for_consumer: bool = False
    """The radio's time begins when the first consumer subscribes."""


class ChannelParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The simulated air of `loopback` and `iqfile`."""

    profile: Literal["awgn", "rayleigh", "tdl-a", "tdl-c"] = "awgn"
    """One path, or echoes that fade anew for each burst."""
    snr_db: Decibel = 30.0
    """Burst power over noise power in the sample band; inf: no noise."""
    clock_ppm: Annotated[float, Meta(ge=-200, le=200)] = 0.0
    """The sender's crystal against the receiver's: centre frequency and sampling clock."""
    delay_s: Annotated[float, Meta(ge=0, le=1)] = 0.0
    delay_spread_s: Annotated[float, Meta(ge=0, le=1e-3)] = 1e-7
    """Spread of the echoes (rms)."""
    loss_db: Decibel = 0.0
    tx_image_db: Decibel = float("inf")
    """IQ imbalance of the sender: its image below the signal."""
    tx_leak_db: Decibel = float("inf")
    """LO leakage of the sender below the signal."""
    rx_image_db: Decibel = float("inf")
    rx_dc_dbfs: Annotated[float, Meta(le=0)] = float("-inf")
    adc_bits: Annotated[int, Meta(ge=0, le=24)] = 0
    """Resolution of the receiver's converter; 0: ideal."""
