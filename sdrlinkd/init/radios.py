"""Initial settings that are known to work with each kind of radio."""

from typing import NamedTuple


class RadioPreset(NamedTuple):
    """Initial settings for one kind of radio."""

    title: str
    backend: str
    device: str = ""
    rate: str = "2 Msps"
    oversampling: int = 1
    soapy: tuple[tuple[str, str], ...] = ()
    """Gains and antennas, as lines of TOML with a comment; sending is always off at first."""
    slot: str = ""
    """Length of a tdma slot, as text; empty: derived from the radio."""

    @property
    def is_real(self) -> bool:
        """Whether this is a physical radio."""
        return self.backend == "soapy"

    @property
    def shares_air(self) -> bool:
        """Whether several robots can hear each other with this radio."""
        return self.backend in ("soapy", "ether")


_LOW = "dB; start low: sdrlinkctl radio probe shows the range"
_ANY = (("tx_gain_db = 30.0", _LOW), ("rx_gain_db = 30.0", ""))

RADIOS = {
    "hackrf": RadioPreset(
        "HackRF One (half duplex: latency of some tenths of a second)", "soapy", "driver=hackrf",
        oversampling=4, slot="0.3 s",
        soapy=(
            ("tx_gains = { AMP = 0, VGA = 20 }", "dB; start low"),
            ("rx_gains = { AMP = 0, LNA = 24, VGA = 20 }", "its input takes at most -5 dBm"),
        ),
    ),
    "usrp": RadioPreset(
        "USRP, through UHD", "soapy", "driver=uhd",
        soapy=(
            ("tx_gain_db = 40.0", _LOW),
            ("rx_gain_db = 40.0", ""),
            ('tx_antenna = "TX/RX"', ""),
            ('rx_antenna = "RX2"', ""),
            ('stream_args = { num_recv_frames = "256" }', ""),
        ),
    ),
    "lime": RadioPreset("LimeSDR", "soapy", "driver=lime", soapy=_ANY),
    "bladerf": RadioPreset("bladeRF", "soapy", "driver=bladerf", soapy=_ANY),
    "pluto": RadioPreset("ADALM-Pluto", "soapy", "driver=plutosdr", soapy=_ANY),
    "soapy": RadioPreset("another SoapySDR device (--device)", "soapy", soapy=_ANY),
    "ether": RadioPreset("none: a simulated channel, many daemons on one computer", "ether",
                         rate="5 Msps"),
    "loopback": RadioPreset("none: one daemon that hears itself through the modem", "loopback",
                            rate="5 Msps"),
    "direct": RadioPreset("none: one daemon that hears itself, without a modem", "direct"),
}  # fmt: skip
"""Presets by name."""
