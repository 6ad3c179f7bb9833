"""SoapySDR through its official Python binding (Debian's python3-soapysdr)."""

from collections.abc import Mapping
from typing import Any

import SoapySDR

from backends.soapy.binding.api import (
    SAMPLE_BYTES,
    DriverError,
    Kwargs,
    Range,
    StreamResult,
    Values,
    check_buffer,
    check_result,
)


class OfficialLibrary:
    """The library, as the module SoapySDR exposes it."""

    @property
    def detail(self) -> str:
        """The version of the library, in words for people."""
        return f"SoapySDR {SoapySDR.getLibVersion()} through its Python binding"

    def modules(self) -> list[str]:
        """Paths of the driver modules that were loaded."""
        SoapySDR.loadModules()
        return list(SoapySDR.listModules())

    def enumerate(self, args: str) -> list[Kwargs]:
        """Device arguments of each attached device that matches. Raises DriverError."""
        return [dict(_called(dict, each)) for each in _called(SoapySDR.Device.enumerate, args)]

    def make(self, args: str) -> "OfficialHandle":
        """Open the device that `args` name. Raises DriverError."""
        return OfficialHandle(_called(SoapySDR.Device, args))


class OfficialHandle:
    """An open device, called through the Python binding."""

    def __init__(self, device: Any) -> None:  # noqa: ANN401  # the binding has no types
        self._device = device

    def call(self, name: str, *arguments: object) -> Any:  # noqa: ANN401
        """Call `SoapySDR::Device::name` with these arguments. Raises DriverError."""
        found = _called(getattr(self._open, name), *arguments)
        if isinstance(found, SoapySDR.Range):
            return _range(found)
        if isinstance(found, str | bytes | Mapping) or not hasattr(found, "__len__"):
            return found
        return [_range(each) if isinstance(each, SoapySDR.Range) else each for each in found]

    def open_stream(
        self, direction: int, channel: int, form: str, args: Kwargs
    ) -> "OfficialStream":
        """Open an inactive stream. Raises DriverError."""
        stream = _called(self._open.setupStream, direction, form, [channel], args)
        if stream is None:
            raise DriverError("the driver provides no stream")
        return OfficialStream(self._open, stream, SAMPLE_BYTES[form])

    def close(self) -> None:
        """Release the device; closing twice is fine."""
        device, self._device = self._device, None
        if device is not None:
            device.close()

    @property
    def _open(self) -> Any:  # noqa: ANN401
        if self._device is None:
            raise DriverError("the device is closed")
        return self._device


class OfficialStream:
    """A stream of one direction, called through the Python binding."""

    def __init__(self, device: Any, stream: Any, size: int) -> None:  # noqa: ANN401
        self._device, self._stream = device, stream
        self._size = size
        self._is_open = True
        self.mtu = int(_called(device.getStreamMTU, stream))

    def activate(self) -> int:
        """Start the flow of samples; returns 0 or a key of ERRORS."""
        return int(_called(self._device.activateStream, self._stream))

    def deactivate(self) -> int:
        """Stop the flow of samples; returns 0 or a key of ERRORS."""
        return int(_called(self._device.deactivateStream, self._stream))

    def read(self, into: Values, timeout_us: int) -> StreamResult:
        """Read samples into all or part of `into`."""
        check_buffer(into, self._size, writeable=True)
        got = _called(self._device.readStream, self._stream, [into], len(into), 0, timeout_us)
        return check_result(StreamResult(got.ret, got.flags, got.timeNs), len(into))

    def write(self, samples: Values, flags: int, time_ns: int, timeout_us: int) -> StreamResult:
        """Write all of `samples`, or the first of them."""
        check_buffer(samples, self._size, writeable=False)
        took = _called(
            self._device.writeStream, self._stream, [samples], len(samples), flags, time_ns,
            timeout_us,
        )  # fmt: skip
        return check_result(StreamResult(took.ret, took.flags, time_ns), len(samples))

    def status(self, timeout_us: int) -> StreamResult:
        """Query what became of samples written earlier."""
        told = _called(self._device.readStreamStatus, self._stream, timeout_us)
        return StreamResult(told.ret, told.flags, told.timeNs)

    def close(self) -> None:
        """Release the stream; closing twice is fine."""
        if self._is_open:
            self._is_open = False
            self._device.closeStream(self._stream)


def _called(call: Any, *arguments: object) -> Any:  # noqa: ANN401
    """Result of `call`; its exceptions become DriverErrors."""
    try:
        return call(*arguments)
    except (RuntimeError, ValueError, IndexError, OSError) as error:
        raise DriverError(str(error)) from None


def _range(found: Any) -> Range:  # noqa: ANN401
    return Range(found.minimum(), found.maximum())
