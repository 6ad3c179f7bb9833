"""Settings of the PDU link: the direct link, the modem, its radios and their simulated air."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from backends import JammerParams

SIMULATED_HZ = 2.45e9
Decibel = Annotated[float, Meta(ge=-300)]


class DirectParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The direct link, which returns PDUs to this daemon without a modem, with faults on demand."""

    hear_self: bool = True
    """Take this robot's own PDUs, as in the paper's loopback experiment."""
    rate_bit_s: Annotated[float, Meta(ge=0, le=1e12)] = 0.0
    """Rate of the link in bit/s; 0: unlimited."""
    loss: Annotated[float, Meta(ge=0, le=1)] = 0.0
    """Share of PDUs that are lost, 0 to 1."""
    delay_s: Annotated[float, Meta(ge=0, le=60)] = 0.0
    """Delay of every PDU, in s."""
    jitter_s: Annotated[float, Meta(ge=0, le=60)] = 0.0
    """Upper end of a random extra delay in s, uniform from 0; it reorders PDUs."""
    duplicate: Annotated[float, Meta(ge=0, le=1)] = 0.0
    """Share of PDUs that arrive twice, 0 to 1."""
    corrupt: Annotated[float, Meta(ge=0, le=1)] = 0.0
    """Share of PDUs that arrive with a flipped bit, 0 to 1."""
    max_pdus_per_burst: Annotated[int, Meta(ge=1, le=63)] = 16
    """Most PDUs of one burst."""


class ModemParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Parameters of the OFDM modem, for every radio."""

    rate_hz: Annotated[float, Meta(ge=1e4, le=2e8)] = 5e6
    """Sample rate in Hz, the same at all nodes; with grid 64/16 the signal occupies 0.83 of it."""
    frequency_hz: Annotated[float, Meta(ge=0, le=1e11)] = 0.0
    """Centre frequency in Hz; 0: not set, and simulations use SIMULATED_HZ."""
    mcs: Annotated[int, Meta(ge=0, le=9)] = 1
    """MCS, the modulation and code rate; `sdrlinkctl phy info` lists them."""
    grid: Literal["64/16", "64/8", "128/16", "256/32"] = "64/16"
    """FFT size and cyclic prefix in samples; the same at all nodes."""
    network: Annotated[int, Meta(ge=0, le=7)] = 0
    """Network number; bursts of other networks are ignored."""
    max_burst_s: Annotated[float, Meta(gt=0, le=1)] = 0.005
    """Longest burst of several PDUs in s, and so the wait that it can cause an urgent message. A
    header that announces a longer burst is refused, so all robots have the same value."""
    tx_lead_s: Annotated[float, Meta(ge=0, le=1)] = 0.005
    """Time in s between composing a burst and its start: enough to compose and modulate it. An
    urgent message may wait for this time in addition to a burst."""
    backoff_db: Annotated[float, Meta(ge=0, le=60)] = 12.0
    """Mean power of a burst below full scale in dB. It leaves room for the peaks, which exceed the
    mean by 7 dB (BPSK, QPSK) to 10 dB (256QAM)."""
    preamble_boost_db: Annotated[float, Meta(ge=0, le=3)] = 0.0
    """Power of the preamble above the rest of the burst in dB. Where peaks limit the amplifier,
    bursts are then found at a longer range."""
    max_cfo_hz: Literal["auto"] | Annotated[float, Meta(ge=0, le=1e6)] = "auto"
    """Largest frequency offset between two radios, in Hz, at which bursts are searched; "auto":
    what follows from `crystal_ppm`, as far as a receiver can search."""
    crystal_ppm: Annotated[float, Meta(ge=0, le=200)] = 40.0
    """Largest frequency error of any radio's crystal, in ppm."""
    one_crystal: bool = True
    """Whether each radio derives its carrier and its sample clock from one crystal, so that the
    offset of the one gives that of the other."""
    carrier_db: Annotated[float, Meta(ge=3, le=40)] = 6.0
    """Energy above the noise floor, in dB, at which the channel counts as busy; for access policies
    that listen."""
    block_s: Annotated[float, Meta(ge=1e-4, le=0.1)] = 0.001
    """Length in s of the blocks in which samples are received."""
    engine: Literal["auto", "compiled", "numpy"] = "auto"
    """What computes the modem: compiled code, or NumPy, which is slow and needs no compiler;
    "auto": compiled code if this machine has it or can make it."""
    oversampling: Literal[1, 2, 4] = 1
    """Ratio of the radio's sample rate to `rate_hz`; for radios that do not support low rates."""

    @property
    def centre_hz(self) -> float:
        """The centre frequency in Hz; SIMULATED_HZ if none is set."""
        return self.frequency_hz or SIMULATED_HZ

    @property
    def apart_hz(self) -> float:
        """Largest difference of two radios' centre frequencies in Hz, with the worst crystals."""
        return 2e-6 * self.crystal_ppm * self.centre_hz

    @property
    def most_cfo_hz(self) -> float:
        """Largest frequency offset in Hz that a receiver can search at this sample rate."""
        return self.rate_hz / 4

    @property
    def searched_cfo_hz(self) -> float:
        """The frequency offset in Hz up to which the receiver searches for bursts."""
        if self.max_cfo_hz == "auto":
            return min(self.apart_hz, self.most_cfo_hz)
        return float(self.max_cfo_hz)


class TransformParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Which transforms of /tf are sent over a slow link, and how."""

    topics: list[str] = []
    """Registry names of type tf2_msgs/TFMessage, such as tf and tf_static."""
    frames: list[str] = []
    """Child frames to send, where * matches any text; empty: all."""
    drop: list[str] = []
    """Child frames not to send."""
    prefix: str = ""
    """Prefix of all frame names, so that the base_link of two robots are two frames."""
    shared: list[str] = msgspec.field(default_factory=lambda: ["map", "world", "earth"])
    """Frames that are the same for all robots; they get no prefix."""
    combine_s: Annotated[float, Meta(ge=0, le=10)] = 0.0
    """Interval in s in which transforms are combined into one message, with the last transform of
    each frame."""


class PlayParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Messages that the daemon itself sends by its radio's time, for simulations in lock-step."""

    bag: str = ""
    """Recording to play; if empty and `duration_s` is set, a built-in robot sends."""
    duration_s: Annotated[float, Meta(ge=0, le=1e6)] = 0.0
    """Length in s of the part of the recording that is sent; 0: nothing."""
    begin_s: Annotated[float, Meta(ge=0, le=1e6)] = 0.0
    """Time of the first message in s, on the radio's clock."""
    wait_for_consumer: bool = False
    """Whether the radio's time begins only when the first consumer subscribes."""


class ChannelParams(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The simulated air of `loopback` and `iqfile`."""

    profile: Literal["awgn", "rayleigh", "tdl-a", "tdl-c"] = "awgn"
    """A single path (awgn), or multipath that fades independently for each burst."""
    snr_db: Decibel = 30.0
    """Burst power over noise power in the sampled band, in dB; inf: no noise."""
    clock_ppm: Annotated[float, Meta(ge=-200, le=200)] = 0.0
    """Offset of the sender's crystal from the receiver's in ppm: carrier and sample clock."""
    delay_s: Annotated[float, Meta(ge=0, le=1)] = 0.0
    """Delay of the signal, in s."""
    delay_spread_s: Annotated[float, Meta(ge=0, le=1e-3)] = 1e-7
    """RMS delay spread of the multipath, in s."""
    loss_db: Decibel = 0.0
    """Attenuation of the signal, in dB."""
    tx_image_db: Decibel = float("inf")
    """IQ imbalance of the sender: level of its image below the signal, in dB."""
    tx_leak_db: Decibel = float("inf")
    """Level of the sender's LO leakage below the signal, in dB."""
    rx_image_db: Decibel = float("inf")
    """IQ imbalance of the receiver: level of the image below the signal, in dB."""
    rx_dc_dbfs: Annotated[float, Meta(le=0)] = float("-inf")
    """DC offset of the receiver in dBFS; -inf: none."""
    adc_bits: Annotated[int, Meta(ge=0, le=24)] = 0
    """Resolution of the receiver's ADC in bits; 0: ideal."""
    jammer: list[JammerParams] = []
    """Signals of others that disturb a `loopback`, each a table `[[channel.jammer]]`. Its keys are
    those of `[[air.jammer]]` in a scenario: kind, over_noise_db, offset_hz, width_hz, period_s,
    duty and times."""
