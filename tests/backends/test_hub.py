"""A hub and its radios: who may join, the messages they get, and how the hub ends."""

import asyncio
import gc
import time
from pathlib import Path

import numpy as np
import pytest

from backends import (
    GAP,
    BackendError,
    EtherHub,
    EtherRadio,
    HubWatch,
    JammerParams,
    Patience,
    RadioParams,
    Tuning,
    TxBurst,
    World,
    hub_in,
)
from backends.testing import AIR, CONSTANTS, NOISE_DBFS, SKY, protocol
from tests.backends.hubs import RawRadio, ask, hub_air, serving, until
from tests.backends.radios import (
    RATE,
    TUNING,
    N,
    heard,
    noise,
    opened,
    send,
    take,
    turn,
)

pytestmark = pytest.mark.usefixtures("at_ease")
TOO_LONG = "x" * 120
"""A socket's path can only have about 100 characters."""


async def refusal(folder, node=1, tuning=TUNING):
    """The reason why a radio may not join."""
    with pytest.raises(BackendError) as refused:
        async with opened(EtherRadio(hub_in(folder), node, "somebody else"), tuning):
            pass
    return str(refused.value)


async def test_radios_join_hear_each_other_and_leave(tmp_path):
    with serving(tmp_path) as hub:
        async with opened(EtherRadio(hub_in(tmp_path), 7, "the seventh")) as one:
            async with opened(EtherRadio(hub_in(tmp_path), 9, "the ninth")) as other:
                assert ask(tmp_path).nodes == {7: "the seventh", 9: "the ninth"}
                begins_s = [hub.medium.time(node, 0) for node in (7, 9)]
                burst = TxBurst(10_000, noise(300))
                hearing = asyncio.ensure_future(take(other.blocks(), 12_000))
                (report,), _ = await send(one, one.blocks(), [burst])
                samples = heard(await hearing)
            await until(lambda: ask(tmp_path).nodes == {7: "the seventh"})
        await until(lambda: ask(tmp_path).nodes == {})
        assert ask(tmp_path).bursts == 1
    first = report.start + round((begins_s[0] - begins_s[1]) * RATE)
    where = np.flatnonzero(np.abs(samples) > 1e-3)
    assert first <= where[0] < where[-1] < first + 300
    assert len(where) > 290


async def test_a_hub_tells_its_radios_of_jammers(tmp_path):
    with serving(tmp_path, jammer=[JammerParams(over_noise_db=40.0)]):
        async with opened(EtherRadio(hub_in(tmp_path), 1, "")) as radio:
            got = heard(await take(radio.blocks(), 5000))
    assert 10 * np.log10(np.mean(np.abs(got) ** 2)) == pytest.approx(NOISE_DBFS + 40, abs=0.1)


async def test_a_block_ends_where_a_burst_has_arrived_unless_it_is_late(tmp_path):
    with serving(tmp_path) as hub:
        async with (
            opened(EtherRadio(hub_in(tmp_path), 1, "")) as radio,
            opened(EtherRadio(hub_in(tmp_path), 2, "")) as other,
        ):
            apart = round((hub.medium.time(2, 0) - hub.medium.time(1, 0)) * RATE)
            burst = TxBurst(9000, noise(730))
            sending = asyncio.ensure_future(send(other, other.blocks(), [burst]))
            taken = await take(radio.blocks(), apart + 12_000)
            (report,), _ = await sending
    end = apart + report.end + GAP
    (last,) = [block for block in taken if block.index < end <= block.index + block.n]
    assert last.index + last.n == end or last.n > N


async def test_a_radio_is_what_the_hub_says_it_is(tmp_path):
    radios = {
        1: RadioParams(
            full_duplex=False, turnaround_s=0.0005, timestamps=False, index_error_s=0.0002
        )
    }
    with serving(tmp_path, radios, block_s=0.004):
        async with opened(EtherRadio(hub_in(tmp_path), 1, "")) as one:
            can = one.capabilities
            assert not can.full_duplex
            assert not can.timestamps
            assert (can.turnaround_s, can.index_error_s) == (0.0005, 0.0002)
            assert (can.paced, can.lockstep, can.block_s) == (True, False, 0.004)
            assert "0.1 Msps" in one.detail
        async with opened(EtherRadio(hub_in(tmp_path), 200, "")) as other:
            assert other.capabilities.full_duplex, "one that it knows nothing of"


def test_another_version_is_refused_and_told_what_to_do(tmp_path):
    hello = protocol.Hello(
        version=protocol.VERSION + 6, node=1, who="", rate_hz=RATE, frequency_hz=868e6
    )
    with serving(tmp_path), RawRadio(tmp_path) as radio:
        radio.ask(hello)
        reason = radio.hear(protocol.Refused).reason
    assert f"speaks version {protocol.VERSION} " in reason
    assert f"the radio version {protocol.VERSION + 6};" in reason
    assert "run hub and daemons from the same sdrlinkd version" in reason


@pytest.mark.parametrize(
    ("tuning", "told"),
    [
        (Tuning(2 * RATE, 868e6), "modem.rate_hz: got 200000; allowed: 100000"),
        (Tuning(RATE * 1.00001, 868e6), "modem.rate_hz: got 100001; allowed: 100000"),
        (Tuning(float("nan"), 868e6), "modem.rate_hz: got nan; allowed: 100000"),
        (Tuning(RATE, 915e6), "modem.frequency_hz: got 9.15e+08; allowed: 8.68e+08"),
    ],
)
async def test_another_rate_or_frequency_is_refused_with_that_of_the_air(tmp_path, tuning, told):
    with serving(tmp_path):
        assert told in await refusal(tmp_path, tuning=tuning)
        assert ask(tmp_path).nodes == {}


async def test_a_second_robot_of_one_id_is_refused_and_the_first_is_told(tmp_path):
    with serving(tmp_path):
        async with opened(EtherRadio(hub_in(tmp_path), 1, "process 17 on earth")) as first:
            blocks = first.blocks()
            taken = await take(blocks, N)
            reason = await refusal(tmp_path)
            assert "robot 1 is already on this channel: process 17 on earth" in reason
            assert "give one of the two another robot_id" in reason
            while "somebody else" not in first.detail:
                taken += await take(blocks, 1)
            assert (
                "another daemon requested our id 1 on this channel and was refused" in first.detail
            )
            taken += await take(blocks, taken[-1].index + 10 * N)
            assert all(block.samples is not None for block in taken), "it goes on as before"
            assert ask(tmp_path).nodes == {1: "process 17 on earth"}


async def test_an_id_is_free_when_its_robot_is_gone(tmp_path):
    """The robot may leave with Bye or without."""
    with serving(tmp_path):
        async with opened(EtherRadio(hub_in(tmp_path), 1, "the first")):
            pass
        raw = RawRadio(tmp_path)
        await until(lambda: ask(tmp_path).nodes == {})
        raw.join(1)
        raw.vanish()
        async with opened(EtherRadio(hub_in(tmp_path), 1, "the last")) as radio:
            assert ask(tmp_path).nodes == {1: "the last"}
            assert len(await take(radio.blocks(), 5 * N)) >= 1


@pytest.mark.parametrize("exists", [True, False])
async def test_without_a_hub_a_radio_says_how_to_start_one(tmp_path, monkeypatch, exists):
    monkeypatch.setattr(*CONSTANTS["hub_answer_ms"], 50)
    folder = tmp_path if exists else tmp_path / "none"
    reason = await refusal(folder)
    assert reason.startswith(f"{folder}: no hub answers there; start one: ")
    assert f"--dir {folder}" in reason


async def test_a_radio_that_finds_no_hub_waits_until_there_is_one(tmp_path):
    """Within its patience."""
    radio = EtherRadio(hub_in(tmp_path), 1, "the early one")
    opening = asyncio.ensure_future(radio.open(TUNING))
    await turn()
    assert radio.detail == "no hub yet"
    with serving(tmp_path):
        await opening
        assert len(await take(radio.blocks(), N)) >= 1
        await radio.close()


async def test_a_radio_that_was_refused_asks_again_and_again(tmp_path, monkeypatch):
    """Within one opening: nobody starts a process for each question."""
    monkeypatch.setattr(*CONSTANTS["hub_refused_s"], 0.05)
    radio = EtherRadio(hub_in(tmp_path), 1, "the second", Patience.REPLUGGED)
    with serving(tmp_path):
        async with opened(EtherRadio(hub_in(tmp_path), 1, "the first")):
            opening = asyncio.ensure_future(radio.open(TUNING))
            await asyncio.wait((opening,), timeout=0.3)
            assert not opening.done()
        await opening
        assert ask(tmp_path).nodes == {1: "the second"}
        await radio.close()
        # Whoever is not patient is told at once; whoever is closed stops asking.
        async with opened(EtherRadio(hub_in(tmp_path), 1, "the third")):
            again = EtherRadio(hub_in(tmp_path), 1, "the fourth", Patience.REPLUGGED)
            opening = asyncio.ensure_future(again.open(TUNING))
            await asyncio.wait((opening,), timeout=0.1)
            await again.close()
            with pytest.raises(BackendError, match="already on this channel"):
                await opening


async def test_a_folder_has_one_hub(tmp_path):
    with serving(tmp_path):
        with pytest.raises(BackendError, match="another hub serves this folder; stop it, or name"):
            EtherHub(tmp_path, hub_air(), World(hub_air(), {}), {})
        async with opened(EtherRadio(hub_in(tmp_path), 1, "")) as radio:
            assert len(await take(radio.blocks(), 5 * N)) >= 1, "the first goes on"
    assert not (tmp_path / AIR).exists()
    assert not (tmp_path / SKY).exists()
    with serving(tmp_path):
        assert ask(tmp_path).nodes == {}


def test_a_hub_makes_its_folder(tmp_path):
    with serving(tmp_path / "one" / "two"):
        assert ask(tmp_path / "one" / "two").nodes == {}


def test_a_folder_that_cannot_be_had_is_named(own_rights):
    folder = Path("mine")
    folder.mkdir(0o500)
    with pytest.raises(BackendError, match=r"ether\.lock: cannot be opened \(Permission denied\)"):
        EtherHub(folder / "x", hub_air(), World(hub_air(), {}), {})


def test_a_hub_whose_folder_has_too_long_a_name_says_so(tmp_path):
    with pytest.raises(BackendError, match=f"{TOO_LONG}.*socket cannot be opened"):
        EtherHub(tmp_path / TOO_LONG, hub_air(), World(hub_air(), {}), {})
    gc.collect()


async def test_a_radio_whose_folder_has_too_long_a_name_says_so(tmp_path):
    assert TOO_LONG in await refusal(tmp_path / TOO_LONG)
    gc.collect()


def test_a_watch_whose_folder_has_too_long_a_name_says_so(tmp_path):
    with pytest.raises(BackendError, match=TOO_LONG):
        HubWatch(tmp_path / TOO_LONG)
    gc.collect()


async def test_whoever_watches_is_told_how_it_goes(tmp_path):
    with serving(tmp_path):
        async with opened(EtherRadio(hub_in(tmp_path), 3, "robot three")) as radio:
            late = TxBurst(0, noise(10), latest=0)
            await send(radio, radio.blocks(), [TxBurst(0, noise(10))] * 2 + [late])
            with HubWatch(tmp_path) as watch:
                first = watch.ask()
                await until(lambda: watch.ask().now_s > first.now_s)
    assert first.nodes == {3: "robot three"}
    assert first.now_s > 0
    assert not first.is_over
    assert (first.bursts, first.bursts_late, first.bursts_lost) == (2, 1, 0)


def test_who_watches_where_no_hub_is_is_told_so(tmp_path):
    with (
        HubWatch(tmp_path, timeout_s=0.05) as watch,
        pytest.raises(BackendError, match="the hub does not answer"),
    ):
        watch.ask()


async def test_a_paced_hub_runs_in_real_time(tmp_path):
    late_s, told_s = [], []
    with serving(tmp_path):
        async with opened(EtherRadio(hub_in(tmp_path), 1, "")) as radio:
            began_s = time.monotonic()
            async for block in radio.blocks():
                stream_s = (block.index + block.n) / RATE
                late_s.append(time.monotonic() - began_s - stream_s)
                told_s.append(block.host_ns * 1e-9 - began_s - stream_s)
                if stream_s >= 0.4:
                    break
    # Index 0 is where a block ends at which the radio joined, a little before `began_s`.
    assert min(late_s) > -0.1, "samples before their time"
    quarter = len(late_s) // 4
    assert abs(min(late_s[-quarter:]) - min(late_s[:quarter])) < 0.015
    assert np.ptp(told_s) < 1.5 / RATE
    assert min(np.subtract(late_s, told_s)) > -0.001, "told to be there before they are"
