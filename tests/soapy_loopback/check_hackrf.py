"""Checks of the HackRF-like radio; check_driver.py runs them."""

import time

import numpy as np
from SoapySDR import (
    SOAPY_SDR_NOT_SUPPORTED,
    SOAPY_SDR_RX,
    SOAPY_SDR_TX,
    SOAPY_SDR_UNDERFLOW,
)

from tests.soapy_loopback.bus import Bus
from tests.soapy_loopback.rig import Radio, burst, evm_db, find_burst, new_bus

BLOCK = 131_072


def check_hackrf_short_blocks_never_leave():
    with (
        Bus(bus := new_bus()) as seen,
        Radio(bus, 0, model="hackrf") as one,
        Radio(bus, 1, rxbuf=2_000_000) as other,
    ):
        sent = burst(2064)
        assert one.write(sent) == len(sent)
        assert find_burst(other.hear_for(0.25), sent)[1] < 0.3
        assert seen.stats(0).sent == 0
        assert one.write(np.zeros(BLOCK - len(sent), np.complex64)) == BLOCK - len(sent)
        heard = other.hear_for(0.5)
        at, match = find_burst(heard, sent)
        assert match > 0.95, match
        error = evm_db(heard[at : at + len(sent)], sent)
        return f"padded: {error:.1f} dB"


def check_hackrf_switches_by_itself():
    with Bus(bus := new_bus()) as seen, Radio(bus, 0, model="hackrf") as one:
        assert not one.device.getFullDuplex(SOAPY_SDR_RX, 0)
        assert not one.device.hasHardwareTime()
        first = one.read(BLOCK)
        second = one.read(BLOCK)
        assert first[0] == second[0] == BLOCK
        assert first[2].std() > 0.1 > second[2].std(), "garbage at first"
        assert abs(second[2].mean() - 0.02 * (1 + 1j)) < 0.01
        began = time.monotonic()
        assert one.write(burst(BLOCK)) == BLOCK
        assert seen.stats(0).is_transmitting
        assert one.read(BLOCK)[0] == BLOCK
        took = time.monotonic() - began
        assert not seen.stats(0).is_transmitting
        # Two turnarounds of 20 ms, a block sent, a block received.
        assert 0.16 < took < 1, took
        assert one.status()[0] == SOAPY_SDR_NOT_SUPPORTED
        assert seen.stats(0).sent == BLOCK
        return f"back with samples after {took * 1e3:.0f} ms"


def check_hackrf_transmitter_without_samples():
    with (
        Bus(bus := new_bus()) as seen,
        Radio(bus, 0, model="hackrf", status="yes") as one,
        Radio(bus, 1) as other,
    ):
        assert abs(other.hear_for(0.05).mean()) < 1e-3
        one.device.activateStream(one.tx)
        time.sleep(0.05)
        leak_db = 20 * np.log10(abs(other.hear_for(0.2)[-2000:].mean()))
        assert abs(leak_db + 45) < 2, leak_db
        assert one.status()[0] == SOAPY_SDR_UNDERFLOW
        for _ in range(6):
            one.write(burst(BLOCK))
        time.sleep(0.15)
        one.device.deactivateStream(one.tx)
        assert 0 < seen.stats(0).sent < 6 * BLOCK, "cut"
        assert np.abs(other.hear_for(0.3)[-2000:]).max() < 0.01
        return f"leaks {leak_db:.0f} dBFS"


def check_hackrf_cuts_what_is_in_flight():
    with Bus(bus := new_bus()) as seen, Radio(bus, 0, model="hackrf", inflight=4) as one:
        assert one.write(burst(BLOCK)) == BLOCK
        assert one.read(BLOCK)[0] == BLOCK
        assert seen.stats(0).sent == 0


def check_half_duplex_with_bursts():
    with (
        Bus(bus := new_bus()) as seen,
        Radio(bus, 0, model="plain", duplex="half", turn_us=5000) as one,
        Radio(bus, 1) as other,
    ):
        assert one.read(1024)[0] == 1024
        sent = burst(4000)
        assert one.write(sent) == len(sent)
        ret, stamp, _ = one.read(1024)
        assert ret == 1024
        answer = one.status()
        assert answer[0] == 0
        assert one.index(stamp) - one.index(answer[2]) >= one.rate * 5e-3
        start = answer[2] - round(len(sent) / one.rate * 1e9)
        assert find_burst(other.read_from(start, len(sent)), sent)[1] > 0.95
        assert seen.stats(0).bursts == 1


def check_hackrf_rates_and_gains():
    with Bus(bus := new_bus()), Radio(bus, 0, model="hackrf", rate=1e6) as one:
        device = one.device
        assert one.rate == 2e6
        device.setGain(SOAPY_SDR_RX, 0, "LNA", 39)
        assert device.getGain(SOAPY_SDR_RX, 0, "LNA") == 32
        device.setGain(SOAPY_SDR_TX, 0, "AMP", 14)
        device.setGain(SOAPY_SDR_TX, 0, "VGA", 20)
        assert device.getGain(SOAPY_SDR_TX, 0) == 34
