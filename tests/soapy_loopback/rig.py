"""Radios for the checks, through the official binding: needs `import SoapySDR`."""

import time
import uuid

import numpy as np
import SoapySDR
from SoapySDR import (
    SOAPY_SDR_CF32,
    SOAPY_SDR_END_BURST,
    SOAPY_SDR_HAS_TIME,
    SOAPY_SDR_OVERFLOW,
    SOAPY_SDR_RX,
    SOAPY_SDR_TIMEOUT,
    SOAPY_SDR_TX,
)

FREQUENCY = 2.4e9
# Full scale and numpy type of each format.
FORMATS = {"CF32": (1.0, np.complex64), "CS16": (32768, np.int16), "CS8": (128, np.int8)}


def new_bus():
    """An unused bus name."""
    return f"check-{uuid.uuid4().hex[:12]}"


def burst(n, seed=1, rms=0.25):
    """White Gaussian samples."""
    parts = np.random.default_rng(seed).normal(0, rms / np.sqrt(2), (2, n))
    return (parts[0] + 1j * parts[1]).astype(np.complex64)


class Radio:
    """A device with both streams, at unity gain to other units; RX is active."""

    def __init__(self, bus, unit, rate=2e6, model="usrp", form=SOAPY_SDR_CF32, **args):
        args = {"bus": bus, "unit": unit, "model": model} | args
        text = {key: str(value) for key, value in args.items()}
        self.device = SoapySDR.Device({"driver": "loopback"} | text)
        for direction, gain_db in ((SOAPY_SDR_RX, 20), (SOAPY_SDR_TX, 40)):
            self.device.setSampleRate(direction, 0, rate)
            self.device.setFrequency(direction, 0, FREQUENCY)
            self.device.setGain(direction, 0, gain_db)
        self.rate = self.device.getSampleRate(SOAPY_SDR_RX, 0)
        self.full_scale, self.dtype = FORMATS[form]
        self.rx = self.device.setupStream(SOAPY_SDR_RX, form)
        self.tx = self.device.setupStream(SOAPY_SDR_TX, form)
        self.mtu = self.device.getStreamMTU(self.tx)
        self.device.activateStream(self.rx)

    def now_ns(self):
        return self.device.getHardwareTime()

    def index(self, time_ns):
        return SoapySDR.timeNsToTicks(time_ns, self.rate)

    def write(self, samples, time_ns=None, ends=True, timeout_us=200_000):
        """One call of writeStream; returns the number of samples accepted, or the error."""
        flags = ends * SOAPY_SDR_END_BURST
        if time_ns is not None:
            flags |= SOAPY_SDR_HAS_TIME
        raw = samples
        if self.dtype is not np.complex64:
            parts = samples.view(np.float32) * self.full_scale
            limits = np.iinfo(self.dtype)
            raw = np.clip(np.round(parts), limits.min, limits.max).astype(self.dtype)
        return self.device.writeStream(
            self.tx, [raw], len(samples), flags, time_ns or 0, timeout_us
        ).ret

    def read(self, n, timeout_us=500_000):
        """One call of readStream; returns its result, its time, and the samples."""
        width = n if self.dtype is np.complex64 else 2 * n
        raw = np.zeros(width, self.dtype)
        answer = self.device.readStream(self.rx, [raw], n, 0, timeout_us)
        got = raw[: len(raw) // n * max(answer.ret, 0)]
        if self.dtype is not np.complex64:
            got = (got.astype(np.float32) / self.full_scale).view(np.complex64)
        return answer.ret, answer.timeNs, got

    def read_from(self, time_ns, n):
        """The samples [time, time + n), located by time stamps."""
        first, blocks = self.index(time_ns), []
        while True:
            ret, stamp, samples = self.read(4080)
            if ret == SOAPY_SDR_OVERFLOW and not blocks:
                continue
            assert ret > 0, ret
            if self.index(stamp) + ret <= first:
                continue
            blocks.append((self.index(stamp), samples))
            if self.index(stamp) + ret >= first + n:
                break
        assert blocks[0][0] <= first, "asked for too late"
        return np.concatenate([samples for _, samples in blocks])[first - blocks[0][0] :][:n]

    def status(self, timeout_us=200_000):
        """The result of readStreamStatus: code, flags and time."""
        answer = self.device.readStreamStatus(self.tx, timeout_us)
        return answer.ret, answer.flags, answer.timeNs

    def hear_for(self, seconds):
        """All samples of the next `seconds`, whatever the time stamps."""
        blocks, until = [], time.monotonic() + seconds
        while time.monotonic() < until:
            ret, _, samples = self.read(self.mtu, 100_000)
            assert ret > 0 or ret in (SOAPY_SDR_TIMEOUT, SOAPY_SDR_OVERFLOW), ret
            blocks.append(samples)
        return np.concatenate(blocks)

    def close(self):
        self.device.closeStream(self.rx)
        self.device.closeStream(self.tx)
        # The binding releases a device when it is garbage-collected.
        self.device = None

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


def refused(act, *args):
    """The exception of a call, as text."""
    try:
        act(*args)
    except Exception as error:
        return str(error) or repr(error)
    raise AssertionError(f"{act} {args} was let through")


def find_burst(heard, sent):
    """Position of `sent` in `heard`, and their correlation (0 to 1)."""
    head = sent[:4096]
    size = 1 << int(np.ceil(np.log2(len(heard) + len(head))))
    spectrum = np.fft.fft(heard, size) * np.conj(np.fft.fft(head, size))
    peaks = np.abs(np.fft.ifft(spectrum))[: len(heard)]
    at = int(np.argmax(peaks))
    energy = np.linalg.norm(heard[at : at + len(head)]) * np.linalg.norm(head)
    return at, peaks[at] / max(energy, 1e-12)


def evm_db(heard, sent):
    """Error relative to what was sent, at the best complex gain."""
    gain = np.vdot(sent, heard) / np.vdot(sent, sent)
    error = np.mean(np.abs(heard - gain * sent) ** 2) / np.mean(np.abs(gain * sent) ** 2)
    return 10 * np.log10(error)
