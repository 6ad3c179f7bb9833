"""SoapySDR through its C library, for interpreters that Debian's binding does not support."""

import ctypes.util
from collections.abc import Callable
from ctypes import (
    CDLL,
    POINTER,
    Structure,
    byref,
    c_bool,
    c_char_p,
    c_double,
    c_int,
    c_long,
    c_longlong,
    c_size_t,
    c_void_p,
    cast,
    string_at,
)  # fmt: skip
from typing import Any

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

NAMES = ("libSoapySDR.so.0.8", "libSoapySDR.so.0.8-3", "libSoapySDR.so")
_PREFIX = "SoapySDRDevice_"


class _Kwargs(Structure):
    _fields_ = (("n", c_size_t), ("keys", POINTER(c_char_p)), ("values", POINTER(c_char_p)))


class _Range(Structure):
    _fields_ = (("low", c_double), ("high", c_double), ("step", c_double))


_Strings, _Ranges = POINTER(c_void_p), POINTER(_Range)
_DIRECTION, _N, _TEXT = (c_int, c_size_t), POINTER(c_size_t), c_char_p
_CALLS: dict[str, tuple[Any, tuple[Any, ...]]] = {
    # In C a list comes with a pointer to its length as the last argument.
    "getDriverKey": (c_void_p, ()),
    "getHardwareKey": (c_void_p, ()),
    "getNumChannels": (c_size_t, (c_int,)),
    "getFullDuplex": (c_bool, _DIRECTION),
    "getStreamFormats": (_Strings, (*_DIRECTION, _N)),
    "getSampleRateRange": (_Ranges, (*_DIRECTION, _N)),
    "setSampleRate": (None, (*_DIRECTION, c_double)),
    "getSampleRate": (c_double, _DIRECTION),
    "getFrequencyRange": (_Ranges, (*_DIRECTION, _N)),
    "setFrequency": (None, (*_DIRECTION, c_double, POINTER(_Kwargs))),
    "getFrequency": (c_double, _DIRECTION),
    "listGains": (_Strings, (*_DIRECTION, _N)),
    "getGainRange": (_Range, _DIRECTION),
    "getGainElementRange": (_Range, (*_DIRECTION, _TEXT)),
    "setGain": (None, (*_DIRECTION, c_double)),
    "setGainElement": (None, (*_DIRECTION, _TEXT, c_double)),
    "getGain": (c_double, _DIRECTION),
    "getGainElement": (c_double, (*_DIRECTION, _TEXT)),
    "hasGainMode": (c_bool, _DIRECTION),
    "setGainMode": (None, (*_DIRECTION, c_bool)),
    "listAntennas": (_Strings, (*_DIRECTION, _N)),
    "setAntenna": (None, (*_DIRECTION, _TEXT)),
    "setBandwidth": (None, (*_DIRECTION, c_double)),
    "getBandwidth": (c_double, _DIRECTION),
    "hasFrequencyCorrection": (c_bool, _DIRECTION),
    "setFrequencyCorrection": (None, (*_DIRECTION, c_double)),
    "listClockSources": (_Strings, (_N,)),
    "setClockSource": (None, (_TEXT,)),
    "hasHardwareTime": (c_bool, (_TEXT,)),
    "getHardwareTime": (c_longlong, (_TEXT,)),
    "writeSetting": (None, (_TEXT, _TEXT)),
}
"""Result and argument types, without the device; None: an int that is 0 on success."""


class NativeLibrary:
    """The C library. Raises DriverError when there is none."""

    def __init__(self) -> None:
        names = (*NAMES, ctypes.util.find_library("SoapySDR"))
        found = next((each for each in names if _loads(each)), None)
        if found is None:
            raise DriverError("libSoapySDR not found")
        self._c = _declared(CDLL(found))

    @property
    def detail(self) -> str:
        """The version of the C library, in words for people."""
        return f"SoapySDR {self._c.SoapySDR_getLibVersion().decode()} through its C library"

    def modules(self) -> list[str]:
        """Paths of the driver modules that were loaded."""
        self._c.SoapySDR_loadModules()
        return _texts(self._c, self._c.SoapySDR_listModules)

    def enumerate(self, args: str) -> list[Kwargs]:
        """Device arguments of each attached device that matches."""
        n = c_size_t()
        found = self._c.SoapySDRDevice_enumerateStrArgs(args.encode(), byref(n))
        devices = [
            {_decoded(each.keys[i]): _decoded(each.values[i]) for i in range(each.n)}
            for each in found[: n.value]
        ]
        self._c.SoapySDRKwargsList_clear(found, n)
        return devices

    def make(self, args: str) -> "NativeHandle":
        """Open the device that `args` name. Raises DriverError."""
        pointer = self._c.SoapySDRDevice_makeStrArgs(args.encode())
        if not pointer:
            raise DriverError(_decoded(self._c.SoapySDRDevice_lastError()))
        return NativeHandle(self._c, c_void_p(pointer))


class NativeHandle:
    """An open device, called through the C library."""

    def __init__(self, c: CDLL, device: c_void_p) -> None:
        self._c = c
        self._device: c_void_p | None = device

    def call(self, name: str, *arguments: object) -> Any:  # noqa: ANN401  # as the table says
        """Call `SoapySDRDevice_name` with these arguments. Raises DriverError."""
        result, kinds = _CALLS[name]
        given = [each.encode() if isinstance(each, str) else each for each in arguments]
        if name == "setFrequency":
            given.append(byref(_Kwargs()))
        if kinds and kinds[-1] is _N:
            n = c_size_t()
            found = self._checked(name, *given, byref(n))
            if result is _Strings:
                return _texts_of(self._c, found, n)
            ranges = [Range(each.low, each.high) for each in found[: n.value]]
            self._c.SoapySDR_free(found)
            return ranges
        found = self._checked(name, *given)
        if result is c_void_p:
            return _text_of(self._c, found)
        return Range(found.low, found.high) if result is _Range else found

    def open_stream(self, direction: int, channel: int, form: str, args: Kwargs) -> "NativeStream":
        """Open an inactive stream. Raises DriverError."""
        keys = (c_char_p * len(args))(*(key.encode() for key in args))
        values = (c_char_p * len(args))(*(value.encode() for value in args.values()))
        pointer = self._c.SoapySDRDevice_setupStream(
            self._open, c_int(direction), form.encode(), (c_size_t * 1)(channel), c_size_t(1),
            byref(_Kwargs(len(args), keys, values)),
        )  # fmt: skip
        if not pointer:
            raise DriverError(self._error() or "the driver provides no stream")
        return NativeStream(self._c, self._open, c_void_p(pointer), SAMPLE_BYTES[form])

    def close(self) -> None:
        """Release the device; closing twice is fine."""
        device, self._device = self._device, None
        if device is not None:
            self._c.SoapySDRDevice_unmake(device)

    @property
    def _open(self) -> c_void_p:
        if self._device is None:
            raise DriverError("the device is closed")
        return self._device

    def _error(self) -> str:
        failed = self._c.SoapySDRDevice_lastStatus()
        return _decoded(self._c.SoapySDRDevice_lastError()) if failed else ""

    def _checked(self, name: str, *arguments: object) -> Any:  # noqa: ANN401
        found = getattr(self._c, _PREFIX + name)(self._open, *arguments)
        if error := self._error():
            raise DriverError(error)
        return found


class NativeStream:
    """A stream of one direction; prepares its call arguments once, because calls are frequent."""

    def __init__(self, c: CDLL, device: c_void_p, stream: c_void_p, size: int) -> None:
        self._c = c
        self._at = (device, stream)
        self._size = size
        self._buffers = (c_void_p * 1)()
        self._flags, self._time_ns, self._mask = c_int(), c_longlong(), c_size_t()
        self._is_open = True
        self.mtu = int(c.SoapySDRDevice_getStreamMTU(*self._at))

    def activate(self) -> int:
        """Start the flow of samples; returns 0 or a key of ERRORS."""
        return int(
            self._c.SoapySDRDevice_activateStream(*self._at, c_int(0), c_longlong(0), c_size_t(0))
        )

    def deactivate(self) -> int:
        """Stop the flow of samples; returns 0 or a key of ERRORS."""
        return int(self._c.SoapySDRDevice_deactivateStream(*self._at, c_int(0), c_longlong(0)))

    def read(self, into: Values, timeout_us: int) -> StreamResult:
        """Read samples into all or part of `into`."""
        check_buffer(into, self._size, writeable=True)
        self._buffers[0] = into.ctypes.data
        self._flags.value = 0
        n = self._c.SoapySDRDevice_readStream(
            *self._at, self._buffers, c_size_t(len(into)), byref(self._flags),
            byref(self._time_ns), c_long(timeout_us),
        )  # fmt: skip
        return check_result(StreamResult(n, self._flags.value, self._time_ns.value), len(into))

    def write(self, samples: Values, flags: int, time_ns: int, timeout_us: int) -> StreamResult:
        """Write all of `samples`, or the first of them."""
        check_buffer(samples, self._size, writeable=False)
        self._buffers[0] = samples.ctypes.data
        self._flags.value = flags
        n = self._c.SoapySDRDevice_writeStream(
            *self._at, self._buffers, c_size_t(len(samples)), byref(self._flags),
            c_longlong(time_ns), c_long(timeout_us),
        )  # fmt: skip
        return check_result(StreamResult(n, self._flags.value, time_ns), len(samples))

    def status(self, timeout_us: int) -> StreamResult:
        """Query what became of samples written earlier."""
        self._flags.value = 0
        n = self._c.SoapySDRDevice_readStreamStatus(
            *self._at, byref(self._mask), byref(self._flags), byref(self._time_ns),
            c_long(timeout_us),
        )  # fmt: skip
        return StreamResult(n, self._flags.value, self._time_ns.value)

    def close(self) -> None:
        """Release the stream; closing twice is fine."""
        if self._is_open:
            self._is_open = False
            self._c.SoapySDRDevice_closeStream(*self._at)


def _loads(name: str | None) -> bool:
    try:
        return name is not None and bool(CDLL(name))
    except OSError:
        return False


def _declared(c: CDLL) -> CDLL:
    for name, (result, kinds) in _CALLS.items():
        call = getattr(c, _PREFIX + name)
        call.restype, call.argtypes = result or c_int, (c_void_p, *kinds)
    for name, result in (
        ("Device_makeStrArgs", c_void_p), ("Device_setupStream", c_void_p),
        ("Device_getStreamMTU", c_size_t), ("Device_lastError", c_char_p),
        ("Device_enumerateStrArgs", POINTER(_Kwargs)), ("_getLibVersion", c_char_p),
        ("_listModules", _Strings),
    ):  # fmt: skip
        getattr(c, "SoapySDR" + name).restype = result
    return c


def _decoded(text: bytes | None) -> str:
    return (text or b"").decode("utf-8", "replace")


def _text_of(c: CDLL, pointer: int | None) -> str:
    """Copy a C string that we own, and free it."""
    text = _decoded(string_at(pointer)) if pointer else ""
    c.SoapySDR_free(c_void_p(pointer))
    return text


def _texts(c: CDLL, listed: Callable[[Any], Any]) -> list[str]:
    n = c_size_t()
    return _texts_of(c, listed(byref(n)), n)


def _texts_of(c: CDLL, found: Any, n: c_size_t) -> list[str]:  # noqa: ANN401  # char **
    texts = [_decoded(string_at(found[i])) for i in range(n.value)]
    strings = cast(found, POINTER(c_char_p))
    c.SoapySDRStrings_clear(byref(strings), n)
    return texts
