"""An open device: its capabilities and its settings."""

from backends.soapy.binding.api import RX, TX, DriverError, Handle, Kwargs, Library, Range, Stream

DIRECTIONS = {RX: "rx", TX: "tx"}


class Device:
    """A SoapySDR device. Calls raise DriverError; `direction` is RX or TX."""

    def __init__(self, library: Library, args: str) -> None:
        self._handle: Handle = library.make(args)
        self.driver: str = self._handle.call("getDriverKey")
        self.hardware: str = self._handle.call("getHardwareKey")

    def channels(self, direction: int) -> int:
        """Number of channels in a direction; 0: the device does not support it."""
        return int(self._handle.call("getNumChannels", direction))

    def full_duplex(self, channel: int) -> bool:
        """Whether the device receives while it sends."""
        return bool(self._handle.call("getFullDuplex", RX, channel))

    def formats(self, direction: int, channel: int) -> list[str]:
        """Sample formats of its streams, by SoapySDR's names."""
        return list(self._handle.call("getStreamFormats", direction, channel))

    def rates(self, direction: int, channel: int) -> list[Range]:
        """Sample rates that the device offers, in Hz."""
        return list(self._handle.call("getSampleRateRange", direction, channel))

    def set_rate(self, direction: int, channel: int, rate_hz: float) -> float:
        """Set the sample rate (Hz); returns the rate that the device chose."""
        self._handle.call("setSampleRate", direction, channel, rate_hz)
        return float(self._handle.call("getSampleRate", direction, channel))

    def frequencies(self, direction: int, channel: int) -> list[Range]:
        """Frequencies that the device can be tuned to, in Hz."""
        return list(self._handle.call("getFrequencyRange", direction, channel))

    def set_frequency(self, direction: int, channel: int, frequency_hz: float) -> float:
        """Tune to a frequency (Hz); returns the frequency that the device chose."""
        self._handle.call("setFrequency", direction, channel, frequency_hz)
        return float(self._handle.call("getFrequency", direction, channel))

    def gains(self, direction: int, channel: int) -> list[str]:
        """Names of its gain elements."""
        return list(self._handle.call("listGains", direction, channel))

    def gain_range(self, direction: int, channel: int, element: str = "") -> Range:
        """Gain range (dB) of an element; "" means the overall gain."""
        if element:
            return Range(*self._handle.call("getGainElementRange", direction, channel, element))
        return Range(*self._handle.call("getGainRange", direction, channel))

    def set_gain(self, direction: int, channel: int, element: str, gain_db: float) -> float:
        """Set the gain (dB) of an element, or the overall gain (""); returns the gain in force."""
        if not element:
            self._handle.call("setGain", direction, channel, gain_db)
            return float(self._handle.call("getGain", direction, channel))
        self._handle.call("setGainElement", direction, channel, element, gain_db)
        return float(self._handle.call("getGainElement", direction, channel, element))

    def set_manual_gain(self, direction: int, channel: int) -> None:
        """Switch automatic gain off, because it would change the gain in the middle of bursts."""
        if self._handle.call("hasGainMode", direction, channel):
            self._handle.call("setGainMode", direction, channel, False)

    def antennas(self, direction: int, channel: int) -> list[str]:
        """Names of its antenna connectors."""
        return list(self._handle.call("listAntennas", direction, channel))

    def set_antenna(self, direction: int, channel: int, name: str) -> None:
        """Select the antenna connector of that name."""
        self._handle.call("setAntenna", direction, channel, name)

    def set_bandwidth(self, direction: int, channel: int, bandwidth_hz: float) -> float:
        """Set the analogue filter (Hz); returns the bandwidth that the device chose."""
        self._handle.call("setBandwidth", direction, channel, bandwidth_hz)
        return float(self._handle.call("getBandwidth", direction, channel))

    def set_ppm(self, direction: int, channel: int, ppm: float) -> None:
        """Correct the crystal by `ppm`. Raises DriverError if the device does not support it."""
        if not self._handle.call("hasFrequencyCorrection", direction, channel):
            raise DriverError("this device does not support crystal correction")
        self._handle.call("setFrequencyCorrection", direction, channel, ppm)

    def clock_sources(self) -> list[str]:
        """Names of the available sources of its reference frequency."""
        return list(self._handle.call("listClockSources"))

    def set_clock_source(self, name: str) -> None:
        """Select the clock source of that name."""
        self._handle.call("setClockSource", name)

    def has_time(self) -> bool:
        """Whether the device stamps its samples by its own clock."""
        return bool(self._handle.call("hasHardwareTime", ""))

    def time_ns(self) -> int:
        """Current time of the device's own clock."""
        return int(self._handle.call("getHardwareTime", ""))

    def write_setting(self, key: str, value: str) -> None:
        """Write a setting that is specific to this driver."""
        self._handle.call("writeSetting", key, value)

    def open_stream(self, direction: int, channel: int, form: str, args: Kwargs) -> Stream:
        """Open an inactive stream with samples of type `form`."""
        return self._handle.open_stream(direction, channel, form, args)

    def close(self) -> None:
        """Release the device, streams first; closing twice is fine."""
        self._handle.close()
