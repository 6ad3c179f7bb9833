"""SoapySDR by its own Python binding (Debian's python3-soapysdr)."""

from collections.abc import Mapping
from typing import Any

import SoapySDR

from backends.soapy.surface import (
    SAMPLE_BYTES,
    DriverError,
    Kwargs,
    Moved,
    Range,
    Values,
    check_buffer,
    check_moved,
)


class OfficialLibrary:
    """The module SoapySDR."""

    @property
    def detail(self) -> str:
        """For people."""
        return f"SoapySDR {SoapySDR.getLibVersion()} by its Python binding"

    def modules(self) -> list[str]:
        """Files of the drivers that were loaded."""
        SoapySDR.loadModules()
        return list(SoapySDR.listModules())

    def enumerate(self, args: str) -> list[Kwargs]:
        """Devices that are there."""
        return [dict(_called(dict, each)) for each in _called(SoapySDR.Device.enumerate, args)]

    def make(self, args: str) -> "OfficialHandle":
        """Open a device."""
        return OfficialHandle(_called(SoapySDR.Device, args))


class OfficialHandle:
    """An open device."""

    def __init__(self, device: Any) -> None:  # noqa: ANN401  # the binding has no types
        self._device = device

    def call(self, name: str, *arguments: object) -> Any:  # noqa: ANN401
        """`SoapySDR::Device::name`."""
        found = _called(getattr(self._open, name), *arguments)
        if isinstance(found, SoapySDR.Range):
            return _range(found)
        if isinstance(found, str | bytes | Mapping) or not hasattr(found, "__len__"):
            return found
        return [_range(each) if isinstance(each, SoapySDR.Range) else each for each in found]

    def open_stream(self, way: int, channel: int, form: str, args: Kwargs) -> "OfficialStream":
        """A stream; not active."""
        stream = _called(self._open.setupStream, way, form, [channel], args)
        if stream is None:
            raise DriverError("the driver gives no stream")
        return OfficialStream(self._open, stream, SAMPLE_BYTES[form])

    def close(self) -> None:
        """Give the device back."""
        device, self._device = self._device, None
        if device is not None:
            device.close()

    @property
    def _open(self) -> Any:  # noqa: ANN401
        if self._device is None:
            raise DriverError("the device is closed")
        return self._device


class OfficialStream:
    """A stream."""

    def __init__(self, device: Any, stream: Any, size: int) -> None:  # noqa: ANN401
        self._device, self._stream = device, stream
        self._size = size
        self._is_open = True
        self.mtu = int(_called(device.getStreamMTU, stream))

    def activate(self) -> int:
        """Begin; 0 or an error."""
        return int(_called(self._device.activateStream, self._stream))

    def deactivate(self) -> int:
        """End; 0 or an error."""
        return int(_called(self._device.deactivateStream, self._stream))

    def read(self, into: Values, timeout_us: int) -> Moved:
        """Fill `into`, or a part of it."""
        check_buffer(into, self._size, writeable=True)
        got = _called(self._device.readStream, self._stream, [into], len(into), 0, timeout_us)
        return check_moved(Moved(got.ret, got.flags, got.timeNs), len(into))

    def write(self, samples: Values, flags: int, time_ns: int, timeout_us: int) -> Moved:
        """Hand over `samples`, or the first of them."""
        check_buffer(samples, self._size, writeable=False)
        took = _called(
            self._device.writeStream, self._stream, [samples], len(samples), flags, time_ns,
            timeout_us,
        )  # fmt: skip
        return check_moved(Moved(took.ret, took.flags, time_ns), len(samples))

    def status(self, timeout_us: int) -> Moved:
        """What became of samples handed over."""
        told = _called(self._device.readStreamStatus, self._stream, timeout_us)
        return Moved(told.ret, told.flags, told.timeNs)

    def close(self) -> None:
        """Give it back."""
        if self._is_open:
            self._is_open = False
            self._device.closeStream(self._stream)


def _called(call: Any, *arguments: object) -> Any:  # noqa: ANN401
    """What `call` gives; what it throws is the driver's."""
    try:
        return call(*arguments)
    except (RuntimeError, ValueError, IndexError, OSError) as error:
        raise DriverError(str(error)) from None


def _range(found: Any) -> Range:  # noqa: ANN401
    return Range(found.minimum(), found.maximum())
