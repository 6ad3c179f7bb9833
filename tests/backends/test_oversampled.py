"""A radio at twice or four times the rate: callers see their own rate, bursts and gaps in place."""

import pytest

from backends import (
    GAP,
    LoopbackRadio,
    OversampledRadio,
    RadioParams,
    Tuning,
    TxBurst,
    hub_in,
)
from backends.testing import TRIM
from phy import REACH
from tests.backends.hubs import NODE, EtherRadio, serving
from tests.backends.radios import AIR, BLOCK_S, RATE, TUNING, heard, opened, send, take
from tests.backends.two_bursts import assert_heard, two_bursts

pytestmark = pytest.mark.usefixtures("at_ease")
factors = pytest.mark.parametrize("factor", [2, 4])


@factors
async def test_bursts_are_heard_at_their_index_whatever_the_factor(factor):
    radio = OversampledRadio(LoopbackRadio(AIR, BLOCK_S, paced=False), factor)
    async with opened(radio):
        assert f"{factor} times oversampled" in radio.detail
        assert radio.capabilities.lead_s >= REACH / RATE
        blocks = radio.blocks()
        reports, taken = await send(radio, blocks, sent := two_bursts(700))
        taken += await take(blocks, reports[-1].end + 500)
    assert [block.index for block in taken[1:]] == [block.index + block.n for block in taken[:-1]]
    assert taken[0].index == 0
    assert_heard(heard(taken), sent, reports)


@factors
async def test_bursts_as_close_as_others_plan_them_do_not_get_in_each_others_way(factor):
    first, second = two_bursts(700)
    close = first.start + len(first.samples) + GAP
    sent = [first, TxBurst(close, second.samples, latest=close)]
    async with opened(OversampledRadio(LoopbackRadio(AIR, BLOCK_S, paced=False), factor)) as radio:
        blocks = radio.blocks()
        reports, taken = await send(radio, blocks, sent)
        taken += await take(blocks, reports[-1].end + 500)
    assert_heard(heard(taken), sent, reports)


@factors
async def test_gaps_are_as_long_as_they_were_and_the_time_goes_on(factor, tmp_path):
    """A half-duplex radio hears nothing around its bursts."""
    params = {NODE: RadioParams(full_duplex=False, turnaround_s=0.001)}
    with serving(tmp_path, params, paced=False, rate_hz=factor * RATE):
        radio = OversampledRadio(EtherRadio(hub_in(tmp_path), NODE, "under test"), factor)
        async with opened(radio, Tuning(RATE, TUNING.frequency_hz)):
            blocks = radio.blocks()
            (report,), taken = await send(radio, blocks, two_bursts(2000)[:1])
            taken += await take(blocks, report.end + 1000)
    at = 0
    for block in taken:
        assert block.index == at
        at += block.n
    gap = [block for block in taken if block.samples is None]
    begin, end = gap[0].index, gap[-1].index + gap[-1].n
    deaf = 0.001 * RATE + REACH - TRIM / factor
    assert report.start - begin == pytest.approx(deaf, abs=2)
    assert end - report.end == pytest.approx(deaf, abs=2)
