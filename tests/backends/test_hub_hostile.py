"""Whatever anybody says to a hub, it serves those who speak its protocol."""

import asyncio
from random import Random

import numpy as np
import pytest

from backends import EtherRadio, RadioParams, TxBurst, TxOutcome, hub_in
from backends.testing import protocol
from tests.backends.hubs import RawRadio, ask, serving, until
from tests.backends.radios import RATE, TUNING, N, noise, opened, send, take

pytestmark = pytest.mark.usefixtures("at_ease")
GOOD = [
    protocol.Question(),
    protocol.Hello(
        version=protocol.VERSION, node=9, who="x", rate_hz=RATE, frequency_hz=TUNING.frequency_hz
    ),
    protocol.Sent(token=5, number=1, start=0, latest=None, late_seen=0),
    protocol.Done(token=5, step=2**40),
    protocol.Bye(token=5),
]
# A map whose field "x", that nobody knows, holds a list in a list in a list …
DEEP = b"\x82\xa4type\xa8Question\xa1x" + b"\x91" * 100_000 + b"\xc0"
DEEP_BYE = b"\x83\xa4type\xa3Bye\xa5token\x05\xa1x" + b"\x91" * 100_000 + b"\xc0"
paced_or_not = pytest.mark.parametrize("paced", [True, False], ids=["paced", "lockstep"])


def garbage(rng):
    """Random frames, or messages that were tampered with."""
    kind = rng.randrange(4)
    if kind == 0:
        return [rng.randbytes(rng.randrange(200)) for _ in range(rng.randrange(1, 4))]
    data = bytearray(protocol.encode(rng.choice(GOOD)))
    if kind == 1:
        for _ in range(rng.randrange(1, 4)):
            data[rng.randrange(len(data))] = rng.randrange(256)
    elif kind == 2:
        del data[rng.randrange(len(data)) :]
    return [bytes(data), rng.randbytes(rng.randrange(40))][: rng.randrange(1, 3)]


async def assert_goes_on(radio, blocks):
    """Assert that the radio still hears, and that its bursts still leave."""
    async with asyncio.timeout(10):
        (report,), taken = await send(radio, blocks, [TxBurst(0, noise(100))])
        assert report.outcome is TxOutcome.SENT
        assert all(block.samples is not None for block in taken)


async def heard_all(folder, raw):
    """Wait until both of the hub's sockets have been read up to here."""
    raw.ask(protocol.Question())
    await asyncio.to_thread(raw.hear, protocol.Answer)


@paced_or_not
@pytest.mark.parametrize("seed", [1, 2, 3])
async def test_any_bytes_on_any_socket_are_survived(tmp_path, paced, seed):
    rng = Random(seed)
    with serving(tmp_path, {1: RadioParams()}, paced), RawRadio(tmp_path) as raw:
        async with opened(EtherRadio(hub_in(tmp_path), 1, "the radio")) as radio:
            blocks = radio.blocks()
            await take(blocks, N)
            for _ in range(300):
                raw.ask(*garbage(rng))
                raw.push(*garbage(rng))
            # Whole messages on the wrong socket.
            for message in GOOD:
                raw.push(message)
            for message in GOOD[2:]:
                raw.ask(message)
            await heard_all(tmp_path, raw)
            await assert_goes_on(radio, blocks)
            assert ask(tmp_path).nodes[1] == "the radio", f"seed {seed}"


@paced_or_not
async def test_messages_of_any_depth_are_survived(tmp_path, paced):
    with serving(tmp_path, {1: RadioParams()}, paced), RawRadio(tmp_path) as raw:
        async with opened(EtherRadio(hub_in(tmp_path), 1, "the radio")) as radio:
            blocks = radio.blocks()
            await take(blocks, N)
            raw.push(DEEP_BYE)
            raw.ask(DEEP)
            raw.ask(protocol.Question())
            await assert_goes_on(radio, blocks)
            await asyncio.to_thread(raw.hear, protocol.Answer)


async def test_without_its_token_nobody_speaks_for_a_radio(tmp_path):
    with serving(tmp_path), RawRadio(tmp_path) as raw:
        async with opened(EtherRadio(hub_in(tmp_path), 1, "the radio")) as radio:
            blocks = radio.blocks()
            mine = raw.join(2)
            guessed = mine ^ 1
            for message in (
                protocol.Bye(token=guessed),
                protocol.Sent(token=guessed, number=1, start=0, latest=None, late_seen=0),
            ):
                raw.push(message, noise(100).tobytes())
            raw.push(protocol.Bye(token=mine))
            await until(lambda: 2 not in ask(tmp_path).nodes)
            assert ask(tmp_path).bursts == 0
            await assert_goes_on(radio, blocks)


@paced_or_not
@pytest.mark.parametrize("node", [-1, 255, 2**60])
async def test_an_id_that_no_robot_can_have_does_not_join(tmp_path, paced, node):
    """Bursts of such an id would reach nobody."""
    hello = protocol.Hello(
        version=protocol.VERSION, node=node, who="", rate_hz=RATE, frequency_hz=868e6
    )
    with serving(tmp_path, {1: RadioParams()}, paced), RawRadio(tmp_path) as raw:
        raw.ask(hello)
        await heard_all(tmp_path, raw)
        assert ask(tmp_path).nodes == {}
        async with opened(EtherRadio(hub_in(tmp_path), 1, "the radio")) as radio:
            await assert_goes_on(radio, radio.blocks())


BURSTS = {
    "nothing": b"",
    "half a sample": noise(10).tobytes()[:-3],
    "silence": np.zeros(50, np.complex64).tobytes(),
    "not a number": np.full(50, np.nan, np.complex64).tobytes(),
    "infinite": np.full(50, np.inf, np.complex64).tobytes(),
    "very loud": np.full(50, 3e38, np.complex64).tobytes(),
    "very soft": np.full(50, 1e-44, np.complex64).tobytes(),
}


@paced_or_not
@pytest.mark.parametrize("samples", BURSTS.values(), ids=BURSTS)
async def test_whatever_a_robot_sends_the_others_go_on(tmp_path, paced, samples):
    radios = dict.fromkeys((1, 2), RadioParams())
    with serving(tmp_path, radios, paced), RawRadio(tmp_path) as raw:
        async with opened(EtherRadio(hub_in(tmp_path), 1, "the radio")) as radio:
            token = raw.join(2)
            for number, start in enumerate((-(2**63), 0, 2**31, 2**63 - 1, 2**64 - 1)):
                sent = protocol.Sent(
                    token=token, number=number, start=start, latest=None, late_seen=0
                )
                raw.push(sent, samples)
            blocks = radio.blocks()
            begun = asyncio.ensure_future(take(blocks, 3 * N))
            for step in range(3):
                raw.push(protocol.Done(token=token, step=step))
            await begun
            raw.push(protocol.Bye(token=token))
            await until(lambda: 2 not in ask(tmp_path).nodes)
            await assert_goes_on(radio, blocks)
            n_bursts = 0 if len(samples) % 8 or not samples else 5
            assert ask(tmp_path).bursts == n_bursts + 1
