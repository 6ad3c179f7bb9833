"""What we need of SoapySDR, whichever way it is called; both bindings offer just this."""

from typing import Any, NamedTuple, Protocol

from numpy.typing import NDArray

TX, RX = 0, 1
END_BURST, HAS_TIME = 1 << 1, 1 << 2
TIMEOUT, STREAM_ERROR, CORRUPTION, OVERFLOW = -1, -2, -3, -4
NOT_SUPPORTED, TIME_ERROR, UNDERFLOW = -5, -6, -7
ERRORS = {
    TIMEOUT: "timeout", STREAM_ERROR: "stream error", CORRUPTION: "corruption",
    OVERFLOW: "overflow", NOT_SUPPORTED: "not supported", TIME_ERROR: "time error",
    UNDERFLOW: "underflow",
}  # fmt: skip
"""What stream calls return instead of a count."""
SAMPLE_BYTES = {"CF32": 8, "CS16": 4, "CS8": 2}
"""Bytes of a sample in each format that we speak, the cheapest for us first."""

Values = NDArray[Any]
Kwargs = dict[str, str]


class DriverError(Exception):
    """What a driver, or SoapySDR itself, says went wrong."""


class HostError(DriverError):
    """SoapySDR or the driver's module is not installed: waiting does not help."""


class Range(NamedTuple):
    """The values that a device offers, from `low` to `high`."""

    low: float
    high: float


class StreamResult(NamedTuple):
    """Outcome of a stream call: `n` samples, or below 0 a key of ERRORS."""

    n: int
    flags: int
    time_ns: int


class Stream(Protocol):
    """A stream of one direction. Calls wait for at most `timeout_us`."""

    @property
    def mtu(self) -> int:
        """The number of samples that the driver moves at once."""

    def activate(self) -> int:
        """Have samples flow; 0 or a key of ERRORS."""

    def deactivate(self) -> int:
        """Stop the flow of samples; 0 or a key of ERRORS."""

    def read(self, into: Values, timeout_us: int) -> StreamResult:
        """Fill `into` with samples, or a part of it."""

    def write(self, samples: Values, flags: int, time_ns: int, timeout_us: int) -> StreamResult:
        """Hand over `samples` to be sent, or the first of them."""

    def status(self, timeout_us: int) -> StreamResult:
        """Ask what became of samples handed over; `n` is 0 or an error."""

    def close(self) -> None:
        """Give the stream back; closing twice is fine."""


class Handle(Protocol):
    """An open device, by names of SoapySDR's own calls."""

    def call(self, name: str, *arguments: object) -> Any:  # noqa: ANN401  # a text, number, list …
        """Call `SoapySDR::Device::name` with these arguments. Raises DriverError."""

    def open_stream(self, direction: int, channel: int, form: str, args: Kwargs) -> Stream:
        """Open a stream of samples of type `form`, which is not active yet. Raises DriverError."""

    def close(self) -> None:
        """Give the device back, streams first; closing twice is fine."""


class Library(Protocol):
    """The SoapySDR library, by either binding."""

    @property
    def detail(self) -> str:
        """Which binding it is, and which version, in words for people."""

    def modules(self) -> list[str]:
        """The files of the drivers that were loaded."""

    def enumerate(self, args: str) -> list[Kwargs]:
        """The device arguments of each device that is there. Raises DriverError."""

    def make(self, args: str) -> Handle:
        """Open the device that `args` name. Raises DriverError."""


def check_buffer(values: Values, size: int, writeable: bool) -> None:
    """SoapySDR takes addresses on trust. Raises ValueError for what it must not be given."""
    if values.ndim != 1 or not values.flags.c_contiguous:
        raise ValueError(f"a stream's buffer must be one row without steps, got {values.shape}")
    if values.itemsize != size:
        raise ValueError(f"a stream's buffer must hold {size} B a sample, got {values.dtype}")
    if writeable and not values.flags.writeable:
        raise ValueError("a stream cannot read into a buffer that must not be written")


def check_result(result: StreamResult, asked: int) -> StreamResult:
    """A driver that claims more than it was asked for has written elsewhere. Raises DriverError."""
    if result.n > asked:
        raise DriverError(f"the driver claims {result.n} samples of {asked}")
    return result
