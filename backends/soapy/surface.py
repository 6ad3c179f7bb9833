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
"""Of the formats that we speak."""

Values = NDArray[Any]
Kwargs = dict[str, str]


class DriverError(Exception):
    """What a driver, or SoapySDR itself, says went wrong."""


class HostError(DriverError):
    """SoapySDR or the driver's module is not installed: waiting does not help."""


class Range(NamedTuple):
    """From `low` to `high`."""

    low: float
    high: float


class Moved(NamedTuple):
    """Outcome of a stream call: `n` samples, or below 0 a key of ERRORS."""

    n: int
    flags: int
    time_ns: int


class Stream(Protocol):
    """A stream of one direction. Calls wait for at most `timeout_us`."""

    @property
    def mtu(self) -> int:
        """Samples of one transfer."""

    def activate(self) -> int:
        """Begin; 0 or an error."""

    def deactivate(self) -> int:
        """End; 0 or an error."""

    def read(self, into: Values, timeout_us: int) -> Moved:
        """Fill `into`, or a part of it."""

    def write(self, samples: Values, flags: int, time_ns: int, timeout_us: int) -> Moved:
        """Hand over `samples`, or the first of them."""

    def status(self, timeout_us: int) -> Moved:
        """What became of samples handed over; `n` is 0 or an error."""

    def close(self) -> None:
        """Give it back; closing twice is fine."""


class Handle(Protocol):
    """An open device, by names of SoapySDR's own calls."""

    def call(self, name: str, *arguments: object) -> Any:  # noqa: ANN401  # a text, number, list …
        """`SoapySDR::Device::name`. Raises DriverError."""

    def open_stream(self, way: int, channel: int, form: str, args: Kwargs) -> Stream:
        """A stream of samples of type `form`; not active. Raises DriverError."""

    def close(self) -> None:
        """Give the device back, streams first; closing twice is fine."""


class Library(Protocol):
    """SoapySDR."""

    @property
    def detail(self) -> str:
        """Which binding, which version."""

    def modules(self) -> list[str]:
        """Files of the drivers that were loaded."""

    def enumerate(self, args: str) -> list[Kwargs]:
        """Devices that are there. Raises DriverError."""

    def make(self, args: str) -> Handle:
        """Open one. Raises DriverError."""


def check_buffer(values: Values, size: int, writeable: bool) -> None:
    """SoapySDR takes addresses on trust. Raises ValueError for what it must not be given."""
    if values.ndim != 1 or not values.flags.c_contiguous:
        raise ValueError(f"a stream's buffer must be one row without steps, got {values.shape}")
    if values.itemsize != size:
        raise ValueError(f"a stream's buffer must hold {size} B a sample, got {values.dtype}")
    if writeable and not values.flags.writeable:
        raise ValueError("a stream cannot read into a buffer that must not be written")


def check_moved(moved: Moved, asked: int) -> Moved:
    """A driver that claims more than it was asked for has written elsewhere. Raises DriverError."""
    if moved.n > asked:
        raise DriverError(f"the driver claims {moved.n} samples of {asked}")
    return moved
