"""The calls that we need of SoapySDR; both bindings offer exactly these."""

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
"""Names of the error codes that stream calls return instead of a count."""
SAMPLE_BYTES = {"CF32": 8, "CS16": 4, "CS8": 2}
"""Bytes of a sample in each supported format, the one that is cheapest for us first."""

Values = NDArray[Any]
Kwargs = dict[str, str]


class DriverError(Exception):
    """An error that a driver or SoapySDR reports."""


class HostError(DriverError):
    """SoapySDR or the driver's module is not installed: waiting does not help."""


class Range(NamedTuple):
    """The values that a device offers, from `low` to `high`."""

    low: float
    high: float


class StreamResult(NamedTuple):
    """Outcome of a stream call: `n` samples, or a key of ERRORS if negative."""

    n: int
    flags: int
    time_ns: int


class Stream(Protocol):
    """A stream of one direction. Calls wait for at most `timeout_us`."""

    @property
    def mtu(self) -> int:
        """Number of samples that the driver moves at once."""

    def activate(self) -> int:
        """Start the flow of samples; returns 0 or a key of ERRORS."""

    def deactivate(self) -> int:
        """Stop the flow of samples; returns 0 or a key of ERRORS."""

    def read(self, into: Values, timeout_us: int) -> StreamResult:
        """Read samples into all or part of `into`."""

    def write(self, samples: Values, flags: int, time_ns: int, timeout_us: int) -> StreamResult:
        """Write all of `samples`, or the first of them."""

    def status(self, timeout_us: int) -> StreamResult:
        """Query what became of samples written earlier; `n` is 0 or an error."""

    def close(self) -> None:
        """Release the stream; closing twice is fine."""


class Handle(Protocol):
    """An open device, called by the names of SoapySDR's own calls."""

    def call(self, name: str, *arguments: object) -> Any:  # noqa: ANN401  # a text, number, list …
        """Call `SoapySDR::Device::name` with these arguments. Raises DriverError."""

    def open_stream(self, direction: int, channel: int, form: str, args: Kwargs) -> Stream:
        """Open an inactive stream with samples of type `form`. Raises DriverError."""

    def close(self) -> None:
        """Release the device, streams first; closing twice is fine."""


class Library(Protocol):
    """The SoapySDR library, through either binding."""

    @property
    def detail(self) -> str:
        """Which binding and version this is, in words for people."""

    def modules(self) -> list[str]:
        """Paths of the driver modules that were loaded."""

    def enumerate(self, args: str) -> list[Kwargs]:
        """Device arguments of each attached device that matches. Raises DriverError."""

    def make(self, args: str) -> Handle:
        """Open the device that `args` name. Raises DriverError."""


def check_buffer(values: Values, size: int, writeable: bool) -> None:
    """Raise ValueError for an unsuitable buffer: SoapySDR does not check addresses."""
    if values.ndim != 1 or not values.flags.c_contiguous:
        raise ValueError(f"a stream's buffer must be one row without steps, got {values.shape}")
    if values.itemsize != size:
        raise ValueError(f"a stream's buffer must hold {size} B a sample, got {values.dtype}")
    if writeable and not values.flags.writeable:
        raise ValueError("a stream cannot read into a buffer that must not be written")


def check_result(result: StreamResult, asked: int) -> StreamResult:
    """Raise DriverError if a driver claims too many samples: it has written past the buffer."""
    if result.n > asked:
        raise DriverError(f"the driver claims {result.n} samples of {asked}")
    return result
