"""An open device: what it offers, and how it is set."""

from backends.soapy.surface import RX, TX, DriverError, Handle, Kwargs, Library, Range, Stream

WAYS = {RX: "rx", TX: "tx"}


class Device:
    """A SoapySDR device. Calls raise DriverError; `way` is RX or TX."""

    def __init__(self, library: Library, args: str) -> None:
        self._handle: Handle = library.make(args)
        self.driver: str = self._handle.call("getDriverKey")
        self.hardware: str = self._handle.call("getHardwareKey")

    def channels(self, way: int) -> int:
        """How many there are."""
        return int(self._handle.call("getNumChannels", way))

    def full_duplex(self, channel: int) -> bool:
        """Whether it receives while it sends."""
        return bool(self._handle.call("getFullDuplex", RX, channel))

    def formats(self, way: int, channel: int) -> list[str]:
        """Sample formats of its streams."""
        return list(self._handle.call("getStreamFormats", way, channel))

    def rates(self, way: int, channel: int) -> list[Range]:
        """Sample rates offered."""
        return list(self._handle.call("getSampleRateRange", way, channel))

    def set_rate(self, way: int, channel: int, rate_hz: float) -> float:
        """Set it; what it then is."""
        self._handle.call("setSampleRate", way, channel, rate_hz)
        return float(self._handle.call("getSampleRate", way, channel))

    def frequencies(self, way: int, channel: int) -> list[Range]:
        """Carriers offered."""
        return list(self._handle.call("getFrequencyRange", way, channel))

    def set_frequency(self, way: int, channel: int, frequency_hz: float) -> float:
        """Set it; what it then is."""
        self._handle.call("setFrequency", way, channel, frequency_hz)
        return float(self._handle.call("getFrequency", way, channel))

    def gains(self, way: int, channel: int) -> list[str]:
        """Elements of gain."""
        return list(self._handle.call("listGains", way, channel))

    def gain_range(self, way: int, channel: int, element: str = "") -> Range:
        """Of an element, or of all together."""
        if element:
            return Range(*self._handle.call("getGainElementRange", way, channel, element))
        return Range(*self._handle.call("getGainRange", way, channel))

    def set_gain(self, way: int, channel: int, element: str, gain_db: float) -> float:
        """Set an element, or, "", all together; what it then is."""
        if not element:
            self._handle.call("setGain", way, channel, gain_db)
            return float(self._handle.call("getGain", way, channel))
        self._handle.call("setGainElement", way, channel, element, gain_db)
        return float(self._handle.call("getGainElement", way, channel, element))

    def set_manual_gain(self, way: int, channel: int) -> None:
        """No automatic gain: it would change in the middle of bursts."""
        if self._handle.call("hasGainMode", way, channel):
            self._handle.call("setGainMode", way, channel, False)

    def antennas(self, way: int, channel: int) -> list[str]:
        """Their names."""
        return list(self._handle.call("listAntennas", way, channel))

    def set_antenna(self, way: int, channel: int, name: str) -> None:
        """Choose one."""
        self._handle.call("setAntenna", way, channel, name)

    def set_bandwidth(self, way: int, channel: int, bandwidth_hz: float) -> float:
        """Set the filter; what it then is."""
        self._handle.call("setBandwidth", way, channel, bandwidth_hz)
        return float(self._handle.call("getBandwidth", way, channel))

    def set_ppm(self, way: int, channel: int, ppm: float) -> None:
        """Correct the crystal. Raises DriverError where the device cannot."""
        if not self._handle.call("hasFrequencyCorrection", way, channel):
            raise DriverError("this device corrects no crystal")
        self._handle.call("setFrequencyCorrection", way, channel, ppm)

    def clock_sources(self) -> list[str]:
        """Where its frequency may come from."""
        return list(self._handle.call("listClockSources"))

    def set_clock_source(self, name: str) -> None:
        """Choose one."""
        self._handle.call("setClockSource", name)

    def has_time(self) -> bool:
        """Whether samples are stamped."""
        return bool(self._handle.call("hasHardwareTime", ""))

    def time_ns(self) -> int:
        """By its own clock."""
        return int(self._handle.call("getHardwareTime", ""))

    def write_setting(self, key: str, value: str) -> None:
        """What only this driver knows."""
        self._handle.call("writeSetting", key, value)

    def open_stream(self, way: int, channel: int, form: str, args: Kwargs) -> Stream:
        """A stream; not active."""
        return self._handle.open_stream(way, channel, form, args)

    def close(self) -> None:
        """Give it back; streams first."""
        self._handle.close()
