"""Faults, and other processes on the same bus; check_driver.py runs these checks."""

import subprocess
import sys
import time

import numpy as np
import SoapySDR
from SoapySDR import (
    SOAPY_SDR_OVERFLOW,
    SOAPY_SDR_STREAM_ERROR,
    SOAPY_SDR_TIME_ERROR,
    SOAPY_SDR_TIMEOUT,
    SOAPY_SDR_UNDERFLOW,
)

from tests.soapy_loopback.bus import Bus
from tests.soapy_loopback.rig import Radio, burst, evm_db, new_bus, refused

LEAD_NS = 10_000_000
# A radio in another process: reads forever, or sends one burst at its given time.
READER = """
from tests.soapy_loopback.rig import *
with Radio({bus!r}, 1) as radio:
    while True:
        radio.read(2040)
"""
SPEAKER = """
from tests.soapy_loopback.rig import *
with Radio({bus!r}, 1) as radio:
    start = radio.now_ns() + 200_000_000
    radio.write(burst(20_000), start)
    print(start, flush=True)
    print(radio.status(1_000_000)[0], flush=True)
    input()
"""


def other_process(code, bus):
    return subprocess.Popen(
        [sys.executable, "-c", code.format(bus=bus)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )


def wait_for(condition):
    until = time.monotonic() + 10
    while not condition():
        assert time.monotonic() < until, "never happened"
        time.sleep(0.01)


def check_two_processes():
    with Bus(bus := new_bus()) as seen, Radio(bus, 0) as one:
        with other_process(SPEAKER, bus) as other:
            try:
                start = None
                wait_for(lambda: seen.stats(1).is_open)
                start = int(other.stdout.readline())
                heard = one.read_from(start, 20_000)
                error = evm_db(heard, burst(20_000))
                assert error < -50, error
                assert other.stdout.readline() == "0\n"
            finally:
                other.kill()
        wait_for(lambda: not seen.stats(1).is_open)
        with Radio(bus, 1):
            assert seen.stats(1).opened == 2
        return f"{error:.1f} dB"


def check_faults_of_streams():
    with Bus(bus := new_bus()) as seen, Radio(bus, 0, speed=0.1) as one:
        _, stamp, _ = one.read(2040)
        seen.inject(0, "overflow=5000")
        assert one.read(2040)[0] == SOAPY_SDR_OVERFLOW
        ret, after, _ = one.read(2040)
        assert ret == 2040
        assert one.index(after) - one.index(stamp) == 2040 + 5000
        seen.inject(0, "stall")
        assert one.read(2040, 20_000)[0] == SOAPY_SDR_TIMEOUT
        one.device.deactivateStream(one.rx)
        one.device.activateStream(one.rx)
        assert one.read(2040)[0] == 2040

        sent = burst(40_000)
        one.write(sent, one.now_ns() + LEAD_NS)
        time.sleep(0.15)
        one.device.writeSetting("inject", "unit=0:underflow")
        assert one.status()[0] == SOAPY_SDR_UNDERFLOW
        assert seen.stats(0).sent < 40_000
        seen.inject(0, "time_error")
        one.write(sent, one.now_ns() + LEAD_NS)
        assert one.status()[0] == SOAPY_SDR_TIME_ERROR


def check_late_by_return():
    """Like SoapyBladeRF: rejected, with no part of it accepted."""
    with Bus(bus := new_bus()) as seen, Radio(bus, 0, late="return") as one:
        sent = burst(10_000)
        for n in (1, 2):
            assert one.write(sent, one.now_ns()) == SOAPY_SDR_TIME_ERROR
            assert (seen.stats(0).late, seen.stats(0).sent) == (n, 0)
        assert one.status(20_000)[0] == SOAPY_SDR_TIMEOUT
        assert one.write(sent, one.now_ns() + 20 * LEAD_NS) == len(sent)
        assert one.status(1_000_000)[0] == 0
        start = one.now_ns() + 20 * LEAD_NS
        assert one.write(sent, start, ends=False) == len(sent)
        seen.inject(0, "time_error")
        assert one.write(sent, ends=False) == SOAPY_SDR_TIME_ERROR
        assert one.write(sent[:0]) == SOAPY_SDR_TIMEOUT
        ret, _, end = one.status(1_000_000)
        assert (ret, one.index(end)) == (0, one.index(start) + len(sent))


def check_unplugged():
    with Bus(bus := new_bus()) as seen:
        with Radio(bus, 0) as one:
            seen.inject(0, "unplug")
            assert one.read(2040)[0] == SOAPY_SDR_STREAM_ERROR
            assert one.write(burst(100)) == SOAPY_SDR_STREAM_ERROR
            assert one.status()[0] == SOAPY_SDR_STREAM_ERROR
            assert "unplugged" in refused(one.device.setFrequency, 0, 0, 1e9)
            seen.inject(0, "replug")
            assert one.read(2040)[0] == SOAPY_SDR_STREAM_ERROR, "until it is opened anew"
        seen.inject(0, "unplug")
        asked = f"driver=loopback,bus={bus},unit=0,model=usrp"
        assert not SoapySDR.Device.enumerate(asked)
        assert "no loopback device matches" in refused(SoapySDR.Device, asked)
        seen.inject(0, "replug")
        with Radio(bus, 0) as one:
            assert one.read(2040)[0] == 2040


def check_crash_and_hang():
    for fault, code in (("crash", -11), ("hang", None)):
        with Bus(bus := new_bus()) as seen, Radio(bus, 0) as one:
            with other_process(READER, bus) as other:
                wait_for(lambda: seen.stats(1).received > 0)
                seen.inject(1, fault)
                if code is None:
                    time.sleep(0.1)
                    before = seen.stats(1).received
                    time.sleep(0.2)
                    assert seen.stats(1).received == before
                    other.kill()
                assert other.wait(10) == (code or -9)
            assert not seen.stats(1).is_open
            assert np.abs(one.read(2040)[2]).max() < 0.01
