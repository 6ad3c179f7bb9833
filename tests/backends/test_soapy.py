"""Parts of the radio behind SoapySDR: times, plans, bindings, and injected device faults."""

import asyncio
import os
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from backends import (
    BackendError,
    SoapyRadio,
    SoapySettings,
    Tuning,
    TxBurst,
    TxOutcome,
    probe_devices,
)
from backends.soapy.binding import DriverError, StreamResult, driver_of
from backends.soapy.protocol import SampleRing, make_shared
from backends.soapy.settings import timing_of
from backends.testing import DriverLog, SampleClock, TxStream, check_buffer, check_result
from tests.backends.radios import RATE, TUNING, N, noise, opened, take, turn
from tests.soapy_loopback import Bus, missing

needs_radio = pytest.mark.skipif(bool(missing()), reason=missing())
rates = st.one_of(
    st.integers(10_000, 60_000_000).map(float), st.floats(1e4, 6e7), st.just(1920000 / 7)
)


@given(rates, st.integers(0, 1 << 50), st.integers(0, 1 << 40))
def test_indices_become_times_and_the_same_indices_again(rate_hz, zero_ns, index):
    clock = SampleClock(rate_hz, is_stamped=True)
    assert not clock.has_begun
    clock.begin(zero_ns)
    assert clock.has_begun
    assert clock.index_at(clock.time_ns(index)) == index
    later = SampleClock(rate_hz, is_stamped=True)
    later.begin(clock.time_ns(index), index)
    assert abs(later.time_ns(0) - zero_ns) <= 1


@given(rates, st.integers(1, 1 << 40), st.integers(0, 1 << 40), st.integers(0, 1 << 35))
def test_the_index_goes_on_by_the_hosts_clock_between_pieces(rate_hz, seen_ns, end, later_ns):
    clock = SampleClock(rate_hz, is_stamped=False)
    clock.saw(end, seen_ns)
    assert clock.has_begun
    assert clock.now(seen_ns) == end
    assert abs(clock.now(seen_ns + later_ns) - end - later_ns * rate_hz / 1e9) <= 1


@given(st.integers(8, 200), st.lists(st.integers(1, 8), max_size=60))
def test_pieces_in_shared_memory_are_whole_and_come_back(capacity, sizes):
    fd = make_shared(capacity, "test")
    writer, reader = SampleRing(fd, capacity), SampleRing(fd, capacity)
    os.close(fd)
    at = 0
    for number, n in enumerate(sizes):
        at = writer.whole(at, n)
        assert at % capacity + n <= capacity
        writer.view(at, n)[:] = number
        assert np.array_equal(reader.view(at, n), np.full(n, number, np.complex64))
        at += n
        reader.tail = at
        assert writer.tail == at


def test_buffers_that_a_driver_must_not_get_are_refused():
    good = np.zeros(8, np.complex64)
    check_buffer(good, 8, writeable=True)
    for bad in (good[::2], good.reshape(2, 4), good.astype(np.complex128)):
        with pytest.raises(ValueError, match="buffer must"):
            check_buffer(bad, 8, writeable=True)
    good.flags.writeable = False
    check_buffer(good, 8, writeable=False)
    with pytest.raises(ValueError, match="must not be written"):
        check_buffer(good, 8, writeable=True)
    with pytest.raises(DriverError, match="9 samples of 8"):
        check_result(StreamResult(9, 0, 0), 8)


@pytest.mark.parametrize(("form", "full"), [("CS16", 32767), ("CS8", 127)])
def test_other_formats_are_scaled_and_clipped(form, full):
    values = TxStream(None, form).converted(np.array([0.5 - 1j, 3 + 0j], np.complex64))
    assert values.dtype.itemsize == {"CS16": 4, "CS8": 2}[form]
    parts = np.frombuffer(values.tobytes(), {"CS16": "i2", "CS8": "i1"}[form])
    assert parts.tolist() == [round(0.5 * full), -full, full, 0]


def test_a_device_is_named_as_soapysdrs_tools_do():
    assert driver_of("driver=hackrf,serial=1") == "hackrf"
    assert driver_of("serial=1, driver = uhd") == "uhd"
    assert driver_of("serial=1") == ""


def timing(has_time, full_duplex, transfer_s, in_flight=0):
    """Timing of bursts on such a device, with the same settings everywhere here."""
    hardware = SimpleNamespace(
        has_time=has_time, full_duplex=full_duplex, tx_transfer_s=transfer_s, in_flight=in_flight
    )
    return timing_of(hardware, 1, 0.02, 0.05, 0.05, 1.0)


def test_what_counts_samples_hands_over_earlier_and_sends_in_tx_windows():
    timed = timing(True, True, 1e-3)
    assert (timed.lead_s, timed.turnaround_s, timed.tx_windows) == (0.02, 0, None)
    counted = timing(False, True, 0.01)
    assert counted.lead_s > 0.02
    assert counted.tx_windows is None
    half = timing(False, False, 0.01)
    ahead = timing(False, False, 0.01, in_flight=4)
    assert half.turnaround_s == pytest.approx(0.05 + 2 * 0.01)
    assert ahead.lead_s == pytest.approx(half.lead_s + 4 * 0.01)
    assert half.tx_windows.pause_s > half.lead_s + half.turnaround_s + 0.05


def radio(more="", model="plain", **settings):
    """A device that hears itself."""
    return SoapyRadio(
        SoapySettings(
            device=f"driver=loopback,model={model},self=yes,noise_db=-200,mtu={N}{more}",
            rate_hz=0.0, frequency_hz=0.0, block_s=N / RATE, tx_enabled=True, tx_gain_db=40.0,
            rx_gain_db=20.0, dc_block=False, **settings,
        ),
        longest_s=0.1,
    )  # fmt: skip


@pytest.mark.slow
@needs_radio
async def test_without_stamps_and_acknowledgements_bursts_are_counted_in():
    """Their position is only as accurate as the host's clock, but each is sent exactly once."""
    async with opened(radio(",time=no,ack=no")) as each:
        can = each.capabilities
        assert (can.timestamps, can.full_duplex, can.tx_windows) == (False, True, None)
        assert can.index_error_s > 0
        blocks = each.blocks()
        begin = (await take(blocks, 10 * N))[-1].index
        burst = TxBurst(begin + round(0.2 * RATE), noise(3 * N))
        sending = asyncio.ensure_future(each.send(burst))
        taken = []
        while not sending.done():
            taken += await take(blocks, 1)
            await turn()
        taken += await take(blocks, taken[-1].index + 40 * N)
    report = await sending
    assert report.outcome is TxOutcome.SENT
    stream = np.concatenate([block.samples for block in taken])
    found = np.abs(np.correlate(stream, burst.samples, "valid"))
    at = int(found.argmax())
    energy = np.vdot(burst.samples, burst.samples).real
    assert found[at] == pytest.approx(energy, rel=0.01)
    assert taken[0].index + at == pytest.approx(report.start, abs=0.05 * RATE)


@needs_radio
async def test_what_comes_too_late_for_the_device_is_told():
    name = f"late-{os.getpid()}"
    with Bus(name) as bus:
        async with opened(radio(f",time=yes,ack=yes,bus={name},unit=0")) as each:
            blocks = each.blocks()
            now = (await take(blocks, 20 * N))[-1].index
            bus.inject(0, "time_error")
            sending = asyncio.ensure_future(each.send(TxBurst(now + round(0.1 * RATE), noise(N))))
            while not sending.done():
                await take(blocks, 1)
                await turn()
            assert (await sending).outcome is TxOutcome.LATE
            assert each.counters["late"] == 1
            assert bus.stats(0).late == 1


@pytest.mark.slow
@needs_radio
async def test_a_device_in_use_names_itself():
    name = f"used-{os.getpid()}"
    with Bus(name):
        async with opened(radio(f",bus={name},unit=0")):
            with pytest.raises(BackendError, match="in use"):
                await radio(f",bus={name},unit=0").open(TUNING)


@pytest.mark.slow
@needs_radio
@pytest.mark.parametrize("debug", ["", "1"])
async def test_what_drivers_print_is_shown_to_those_who_ask(monkeypatch, tmp_path, capfd, debug):
    (tmp_path / "libbroken.so").write_text("no module")
    path = f"{os.environ['SOAPY_SDR_PLUGIN_PATH']}:{tmp_path}"
    monkeypatch.setenv("SOAPY_SDR_PLUGIN_PATH", path)
    monkeypatch.setenv("SDRLINKD_DEBUG", debug)
    with pytest.raises(BackendError, match="there is no such device"):
        await radio(",absent=yes").open(TUNING)
    out, err = capfd.readouterr()
    assert ("libbroken.so" in out + err) == bool(debug)
    assert bool(out + err) == bool(debug)


@pytest.mark.parametrize(
    ("then", "last"),
    [("print(3 * '\\n')", "last"), ("sys.stdout.write(5000 * 'U')", 4096 * "U")],
    ids=["a blank line", "no newline"],
)
def test_of_what_a_process_prints_the_last_line_is_kept(then, last):
    driver_log = DriverLog()
    code = f"import sys; print('first'); print('last', file=sys.stderr); {then}"
    with subprocess.Popen(
        [sys.executable, "-u", "-c", code], stdout=driver_log.fd, stderr=driver_log.fd
    ) as process:
        driver_log.begin()
        process.wait()
    assert driver_log.last_line() == last


@needs_radio
async def test_the_device_that_is_no_radio_is_told_as_such():
    null = SoapySettings(device="driver=null,type=null", rate_hz=0.0, frequency_hz=0.0)
    with pytest.raises(BackendError, match="built into SoapySDR and not a radio"):
        await SoapyRadio(null, longest_s=0.1).open(TUNING)


@needs_radio
async def test_a_rate_that_the_device_does_not_offer_is_refused():
    with pytest.raises(BackendError, match=r"modem.rate_hz: got 0\.1 Msps .* 0\.2 to 61"):
        await radio(model="usrp").open(Tuning(RATE, 915e6))


@pytest.mark.slow
@needs_radio
def test_a_probe_tells_what_devices_can_do_and_which_module_is_missing():
    (found,) = probe_devices("driver=loopback,model=hackrf").devices
    assert (found.full_duplex, found.has_time, found.timestamped_tx) == (False, False, False)
    assert found.tx.transfer == 131072
    assert found.rx.rates_hz[0].low == 2e6
    assert set(found.rx.gains_db) == {"LNA", "VGA", "AMP"}
    nothing = probe_devices("driver=lime")
    assert not nothing.devices
    assert 'no driver "lime"' in nothing.notes[0]
    assert "soapysdr-module-lms7" in nothing.notes[0]
    for args in ("driver=null", "driver=null,type=null"):
        no_radio = probe_devices(args)
        assert not no_radio.devices
        assert "is built into SoapySDR and not a radio" in no_radio.notes[0]
    absent = probe_devices("driver=loopback,serial=X")
    assert not absent.devices
    assert "there is no such device" in absent.notes[0]


@needs_radio
@pytest.mark.slow
async def test_a_device_that_lies_about_its_rate_is_found_out():
    async with opened(radio(",time=no,ack=no,rate_error=0.05,lie=yes")) as each:
        async for _ in each.blocks():
            if each.counters.get("rate_faults"):
                break
        assert "Msps, but the device claims 0.1" in each.detail
