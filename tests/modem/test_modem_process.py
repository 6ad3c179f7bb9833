"""The modem in a process of its own: what its daemon sees when it works, ends or hangs."""

import asyncio
import contextlib
import mmap
import os
import signal
import socket
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from backends import IqFileParams
from sdrlinkd.config import Config
from sdrlinkd.errors import LinkAbsentError, UserError
from sdrlinkd.link import Outcome, Sensed
from sdrlinkd.modem import make_modem
from sdrlinkd.modem.testing import CONSTANTS, MOST_PULSES, Page, Seen, Shown
from sdrlinkd.spawn import EarlyModem, spawn_modem
from tests.laws import law
from tests.modem.links import Listener, bursts, config, send

TIMES = st.floats(0, 1e9)


def make_page():
    fd = os.memfd_create("page")
    os.ftruncate(fd, mmap.PAGESIZE)
    return fd


@pytest.fixture
def page():
    fd = make_page()
    pages = Page(fd), Page(fd)
    os.close(fd)
    yield pages
    for each in pages:
        each.close()


def test_a_page_is_empty_until_there_is_a_block(page):
    _, reader = page
    assert reader.read() is None
    assert reader.beat_s == 0
    assert not reader.wakes


@law(60)
@given(
    st.integers(0, 1 << 62), TIMES, st.floats(-1e9, 1e9), TIMES, TIMES, st.none() | TIMES,
    st.none() | TIMES, st.lists(TIMES, max_size=20),
)  # fmt: skip
def test_a_page_shows_what_was_written(
    end, host_s, late_s, until, idle_since, burst_at, carrier_at, pulses
):
    fd = make_page()
    writer, reader = Page(fd), Page(fd)
    os.close(fd)
    sensed = Sensed(until, idle_since, burst_at, host_s, carrier_at, tuple(pulses))
    writer.show(Seen(end, host_s, late_s), sensed, end // 2)
    sensed = sensed._replace(pulses=sensed.pulses[-MOST_PULSES:])
    shown = Shown(Seen(end, host_s, late_s), sensed, end // 2)
    assert reader.read() == shown
    writer.beat(until)
    reader.wakes = True
    assert (reader.beat_s, writer.wakes) == (until, True)
    assert reader.read() == shown
    writer.close()
    reader.close()


@law(60)
@given(st.integers(0, 59), st.integers(1, 255))
def test_a_record_that_is_half_written_is_not_read(at, change):
    fd = make_page()
    writer, reader, memory = Page(fd), Page(fd), mmap.mmap(fd, mmap.PAGESIZE)
    os.close(fd)
    before = Shown(Seen(1000, 1.0, 0.5), Sensed(1.0, 0.5, None), 900)
    writer.show(*before)
    assert reader.read() == before
    memory[at] ^= change
    assert reader.read() == before
    assert Page.read(writer) is None
    for each in (writer, reader, memory):
        each.close()


@contextlib.asynccontextmanager
async def opened(settings):
    """(modem link, listener, its carry task, its process)."""
    spawned = spawn_modem()
    modem = make_modem(settings, 1, Random(1), early=EarlyModem(spawned))
    listener = Listener()
    listener.now = modem.now
    try:
        carry = await modem.open(listener)
        task = asyncio.ensure_future(carry())
        yield modem, listener, task, spawned
    finally:
        await modem.close()
        task.cancel()
        await asyncio.wait((task,))


def is_running(spawned):
    with contextlib.suppress(ProcessLookupError):
        os.kill(spawned.process.pid, 0)
        return True
    return False


@pytest.mark.slow
async def test_a_closed_modem_leaves_no_process():
    async with opened(config(paced=True)) as (modem, _, _, spawned):
        assert is_running(spawned)
        await modem.close()
        assert not is_running(spawned)
        await modem.close()


@pytest.mark.slow
async def test_signals_to_the_group_end_it_only_with_its_daemon():
    """Ctrl-C and systemd reach both; the daemon still sends what is queued."""
    sent = list(bursts(5, 3))
    async with opened(config(paced=True)) as (modem, listener, _, spawned):
        for number in (signal.SIGINT, signal.SIGTERM):
            os.kill(spawned.process.pid, number)
        send(modem, listener, sent)
        await listener.until(lambda: len(listener.settled_bursts) == len(sent))
        assert {outcome for _, outcome, _ in listener.settled_bursts} == {Outcome.SENT}


@pytest.mark.slow
async def test_when_it_is_killed_all_bursts_are_settled_once_and_the_link_is_absent():
    sent = list(bursts(6, 40))
    async with opened(config(paced=True)) as (modem, listener, task, spawned):
        send(modem, listener, sent)
        await listener.until(lambda: len(listener.settled_bursts) >= 5)
        os.kill(spawned.process.pid, signal.SIGKILL)
        with pytest.raises(LinkAbsentError, match="the modem process ended by signal 9"):
            await task
        before = modem.now()
        await modem.close()
    settled = [burst.pdus for burst, _, _ in listener.settled_bursts]
    assert settled == [burst.pdus for burst in listener.taken]
    outcomes = [outcome for _, outcome, _ in listener.settled_bursts]
    assert set(outcomes) <= {Outcome.SENT, Outcome.LOST}
    assert modem.now() >= before, "time goes on"


@pytest.mark.slow
async def test_a_process_that_hangs_is_ended(monkeypatch):
    monkeypatch.setattr(*CONSTANTS["hung_s"], 0.5)
    monkeypatch.setattr(*CONSTANTS["watch_s"], 0.1)
    async with opened(config(paced=True)) as (modem, listener, task, spawned):
        send(modem, listener, list(bursts(7, 3)))
        await listener.until(lambda: len(listener.settled_bursts) == 3)
        os.kill(spawned.process.pid, signal.SIGSTOP)
        send(modem, listener, list(bursts(8, 3)))
        with pytest.raises(LinkAbsentError, match="the modem process hung and was ended"):
            await task
    assert len(listener.settled_bursts) == len(listener.taken)
    assert not is_running(spawned)


@pytest.mark.slow
async def test_it_ends_when_its_daemon_is_gone():
    async with opened(config(paced=True)) as (_, _, task, spawned):
        # As if the daemon had been killed: its end of the socket is closed, and nobody listens.
        task.cancel()
        asyncio.get_running_loop().remove_reader(spawned.control)
        spawned.control.shutdown(socket.SHUT_RDWR)
        assert await asyncio.to_thread(spawned.process.wait, 60) == 0


@pytest.mark.slow
async def test_time_goes_on_after_a_restart():
    began_s = asyncio.get_running_loop().time() - 100.0
    modem, listener = make_modem(config(paced=True), 1, Random(1), began_s=began_s), Listener()
    carry = await modem.open(listener)
    task = asyncio.ensure_future(carry())
    send(modem, listener, list(bursts(9, 2)))
    await listener.until(lambda: len(listener.settled_bursts) == 2)
    assert all(100 < at < 200 for _, _, at in listener.settled_bursts)
    await modem.close()
    task.cancel()
    await asyncio.wait((task,))


async def test_a_radio_that_cannot_be_opened_is_told_as_in_this_process(tmp_path):
    settings = Config(backend="iqfile", iqfile=IqFileParams(receive=str(tmp_path / "missing")))
    modem = make_modem(settings, 1, Random(1))
    with pytest.raises(UserError, match="missing"):
        await modem.open(Listener())
    await modem.close()
