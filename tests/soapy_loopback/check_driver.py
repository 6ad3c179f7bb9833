"""Checks of the test radio by Debian's own binding: `/usr/bin/python3 -m …check_driver [NAME…]`.

SOAPY_SDR_PLUGIN_PATH says where the driver is.
"""

import sys
import time
import traceback

import numpy as np
import SoapySDR
from SoapySDR import (
    SOAPY_SDR_END_BURST,
    SOAPY_SDR_HAS_TIME,
    SOAPY_SDR_OVERFLOW,
    SOAPY_SDR_RX,
    SOAPY_SDR_STREAM_ERROR,
    SOAPY_SDR_TIME_ERROR,
    SOAPY_SDR_TIMEOUT,
    SOAPY_SDR_TX,
    SOAPY_SDR_UNDERFLOW,
)

from tests.soapy_loopback import Bus, check_faults, check_hackrf
from tests.soapy_loopback.rig import Radio, burst, evm_db, find_burst, new_bus, refused

LEAD_NS = 100_000_000


def check_found_only_when_asked_for():
    bus = new_bus()
    drivers = [found["driver"] for found in SoapySDR.Device.enumerate()]
    assert "loopback" not in drivers, drivers
    asked = f"driver=loopback,bus={bus},unit=3"
    (found,) = SoapySDR.Device.enumerate(asked)
    assert found["serial"] == "LB3", dict(found)
    for args in (asked + ",serial=LB4", asked + ",absent=yes"):
        assert not SoapySDR.Device.enumerate(args), args
        assert "no loopback device matches" in refused(SoapySDR.Device, args)
    assert "in use" in refused(SoapySDR.Device, asked + ",busy=yes")
    device = SoapySDR.Device(asked)
    assert "in use" in refused(SoapySDR.Device, asked + ",delay=1")
    del device
    Bus(bus).close()


def check_samples_arrive_when_and_as_sent():
    report = []
    for form, limit_db in (("CF32", -45), ("CS16", -45), ("CS8", -32)):
        with (
            Bus(bus := new_bus()),
            Radio(bus, 0, form=form) as one,
            Radio(bus, 1, form=form, delay=37, noise_db=-60) as other,
        ):
            sent = burst(20_000)
            start = one.now_ns() + LEAD_NS
            assert one.write(sent, start) == len(sent)
            heard = other.read_from(start, len(sent) + 100)
            at, _ = find_burst(heard, sent)
            error = evm_db(heard[at : at + len(sent)], sent)
            assert at == 37, at
            assert error < limit_db, error
            report.append(f"{form} {error:.1f} dB")
    return ", ".join(report)


def check_carrier_offset():
    with Bus(bus := new_bus()), Radio(bus, 0, cfo=11234.5) as one, Radio(bus, 1) as other:
        start = one.now_ns() + LEAD_NS
        n = 60_000
        assert one.write(np.full(n, 0.5, np.complex64), start) == n
        heard = other.read_from(start, n)
        half = n // 2
        turn = np.vdot(heard[:half], heard[half:])
        coarse = np.angle(np.vdot(heard[:-1], heard[1:])) * other.rate / (2 * np.pi)
        period = other.rate / half
        fine = np.angle(turn) / (2 * np.pi) * period
        offset = fine + period * round((coarse - fine) / period)
        assert abs(offset - 11234.5) < 0.05, offset
        return f"{offset:.2f} Hz of 11234.50"


def check_sampling_clock():
    # With 100 ppm, a slower receiver hears the same tones higher, and a shorter burst.
    with Bus(bus := new_bus()), Radio(bus, 0, ppm=100) as one, Radio(bus, 1) as other:
        one.device.writeSetting("cfo", str(-100e-6 * 2.4e9))
        rng = np.random.default_rng(1)
        tones = rng.uniform(-0.4, 0.4, 20)
        phases = rng.uniform(0, 1, 20)
        n = 40_000
        turns = np.outer(np.arange(n), tones) + phases
        sent = (np.exp(2j * np.pi * turns).sum(1) / 20).astype(np.complex64)
        start = one.now_ns() + LEAD_NS
        assert one.write(sent, start) == n
        heard = other.read_from(start - LEAD_NS // 10, n + 40_000)
        active = np.flatnonzero(np.abs(heard) > 0.02)
        length = active[-1] - active[0]
        assert abs(length - n * (1 - 100e-6)) < 3, length
        middle = heard[active[0] + n // 2 :][:4000]
        model = np.exp(2j * np.pi * np.outer(np.arange(4000), tones * (1 + 100e-6)))
        levels = np.linalg.lstsq(model, middle, rcond=None)[0]
        error_db = 10 * np.log10(np.var(middle - model @ levels) / np.var(middle))
        assert np.abs(np.abs(levels) * 20 - 1).max() < 0.01, np.abs(levels)
        assert error_db < -45, error_db
        return f"interpolation error {error_db:.0f} dB"


def check_burst_is_told_of_when_it_is_over():
    with Bus(bus := new_bus()) as seen, Radio(bus, 0) as one:
        sent = burst(10_000)
        start = one.now_ns() + LEAD_NS
        assert one.write(sent, start) == len(sent)
        assert not seen.stats(0).is_transmitting
        assert one.status(1000)[0] == SOAPY_SDR_TIMEOUT
        ret, flags, end = one.status()
        late = one.now_ns() - end
        assert ret == 0, ret
        assert flags & SOAPY_SDR_END_BURST
        assert one.index(end) == one.index(start) + len(sent)
        assert one.write(sent[:100], ends=False) == 100
        assert one.write(sent[:0]) == SOAPY_SDR_TIMEOUT
        assert one.status()[0] == 0, "an empty END_BURST ends it, too"
        stats = seen.stats(0)
        assert (stats.bursts, stats.sent) == (2, 10_100), stats
        return f"told {late / 1e3:.0f} µs after its end"


def check_reception_from_a_time_on():
    with Bus(bus := new_bus()), Radio(bus, 0) as one:
        one.device.deactivateStream(one.rx)
        assert one.read(2040, 10_000)[0] == SOAPY_SDR_TIMEOUT
        start = one.now_ns() + LEAD_NS
        one.device.activateStream(one.rx, SOAPY_SDR_HAS_TIME | SOAPY_SDR_END_BURST, start, 5000)
        ret, stamp, _ = one.read(10_000)
        assert (ret, one.index(stamp)) == (5000, one.index(start))
        assert one.read(2040, 10_000)[0] == SOAPY_SDR_TIMEOUT
        one.device.activateStream(one.rx, SOAPY_SDR_HAS_TIME, start)
        assert one.read(2040)[0] == SOAPY_SDR_STREAM_ERROR


def check_late_starved_full():
    with (
        Bus(bus := new_bus()) as seen,
        Radio(bus, 0) as one,
        Radio(bus, 1, rxbuf=1_000_000) as other,
    ):
        sent = burst(10_000)
        assert one.write(sent, one.now_ns(), ends=False) == len(sent)
        assert one.write(sent, ends=True) == len(sent), "dropped up to its end"
        assert one.status()[0] == SOAPY_SDR_TIME_ERROR
        assert one.status(20_000)[0] == SOAPY_SDR_TIMEOUT
        start = one.now_ns() + LEAD_NS
        assert one.write(sent, start, ends=False) == len(sent)
        ret, _, end = one.status()
        assert ret == SOAPY_SDR_UNDERFLOW, ret
        assert one.index(end) == one.index(start) + len(sent)
        assert one.write(sent) == len(sent), "goes on at once"
        assert one.status()[0] == 0
        assert np.abs(other.read_from(start, 12_000)[10_050:]).max() < 0.01
        start = one.now_ns() + 300_000_000
        assert one.write(burst(100_000), start, timeout_us=1000) == 65536
        assert one.write(sent, ends=False, timeout_us=1000) == SOAPY_SDR_TIMEOUT
        stats = seen.stats(0)
        assert (stats.late, stats.underflows) == (1, 1), stats


def check_slow_reader_loses_samples():
    with Bus(bus := new_bus()) as seen, Radio(bus, 0) as one:
        assert one.read(2040)[0] == 2040
        time.sleep(0.25)
        waiting, ret, last = 0, 1, 0
        while ret > 0:
            ret, stamp, _ = one.read(20_400)
            waiting += max(ret, 0)
            last = one.index(stamp)
        assert ret == SOAPY_SDR_OVERFLOW, ret
        assert abs(waiting - 262_144) <= 2 * 2040, waiting
        ret, stamp, _ = one.read(2040)
        assert ret == 2040
        assert abs(one.index(stamp) - last - seen.stats(0).lost) <= 1
        assert abs(stamp - one.now_ns()) < 50_000_000
        return f"{seen.stats(0).lost} lost after {waiting}"


def check_ranges():
    with Bus(bus := new_bus()), Radio(bus, 0) as one:
        device = one.device
        refused(device.setFrequency, SOAPY_SDR_RX, 0, 1e6)
        refused(device.setGain, SOAPY_SDR_TX, 0, 90)
        refused(device.setSampleRate, SOAPY_SDR_RX, 0, 100e6)
        refused(device.setAntenna, SOAPY_SDR_TX, 0, "RX2")
        refused(device.setupStream, SOAPY_SDR_RX, "CU8")
        refused(device.setupStream, SOAPY_SDR_RX, "CF32")
        refused(device.writeSetting, "colour", "green")
        refused(SoapySDR.Device, f"driver=loopback,bus={bus},unit=1,bits=99")
        refused(SoapySDR.Device, f"driver=loopback,bus={bus},unit=1,speed=0.5")
        device.setAntenna(SOAPY_SDR_RX, 0, "RX2")


def check_gains():
    with Bus(bus := new_bus()), Radio(bus, 0) as one, Radio(bus, 1) as other:

        def level():
            start = one.now_ns() + LEAD_NS
            one.write(np.full(8000, 0.25, np.complex64), start)
            return np.abs(other.read_from(start, 8000)).mean()

        assert abs(level() - 0.25) < 0.01
        one.device.setGain(SOAPY_SDR_TX, 0, 46)
        assert abs(level() - 0.5) < 0.01
        other.device.writeSetting("loss_db", "12")
        assert abs(level() - 0.125) < 0.01
        other.device.setGain(SOAPY_SDR_RX, 0, 76)
        assert abs(level() - 1) < 0.01, "saturates"


def check_slow_motion():
    with Bus(bus := new_bus()), Radio(bus, 0, speed=0.1) as one, Radio(bus, 1, speed=0.1) as other:
        began, began_ns = time.monotonic_ns(), one.now_ns()
        sent = burst(5000)
        start = one.now_ns() + LEAD_NS
        one.write(sent, start)
        assert find_burst(other.read_from(start, 5000), sent)[0] == 0
        took, took_ns = time.monotonic_ns() - began, one.now_ns() - began_ns
        assert abs(took_ns / took - 0.1) < 0.01, took_ns / took
        return f"{took_ns / took:.3f}"


def check_rate_that_is_not_as_told():
    for lie, told in (("yes", 2e6), ("no", 2.02e6)):
        args = {"rate_error": 0.01, "lie": lie, "rxbuf": 2_000_000}
        with Bus(bus := new_bus()), Radio(bus, 0, **args) as one:
            assert one.rate == told
            # A busy machine is late now and then, but not three times.
            rates = [_measured_rate(one) for _ in range(3)]
            assert any(abs(rate / 2.02e6 - 1) < 0.003 for rate in rates), rates


def _measured_rate(radio):
    (began, first), _, (ended, last) = _newest(radio), time.sleep(0.5), _newest(radio)
    return (last - first) / (ended - began)


def _newest(radio):
    """Host time, and the index of the sample taken then."""
    index = None
    while True:
        ret, stamp, _ = radio.read(2040, 0)
        now = time.monotonic()
        if ret == SOAPY_SDR_TIMEOUT and index is not None:
            return now, index
        if ret > 0:
            index = radio.index(stamp) + ret


CHECKS = {
    name: check
    for part in (sys.modules[__name__], check_faults, check_hackrf)
    for name, check in vars(part).items()
    if name.startswith("check_") and callable(check)
}

if __name__ == "__main__":
    failed = 0
    for name in sys.argv[1:] or CHECKS:
        began = time.monotonic()
        try:
            detail = CHECKS[name]() or ""
        except Exception:
            traceback.print_exc()
            failed += 1
            detail = "FAILED"
        print(f"{time.monotonic() - began:5.1f} s  {name}  {detail}", flush=True)  # noqa: T201
    sys.exit(failed)
