"""A recording sent on a simulated air, where another robot records it."""

import asyncio

import numpy as np
import pytest

import phy
from backends import EtherRadio, RadioParams, RecordingWriter, hub_in
from sdrlinkd.iq import Capture, CaptureWish, IqRecording, Replay, plan_replay
from tests.backends.hubs import LISTENER, NODE, serving
from tests.backends.radios import RATE, TUNING
from tests.iq.recordings import pdu

N_BURSTS = 5
RADIOS = {NODE: RadioParams(), LISTENER: RadioParams()}


@pytest.fixture
def recording(tmp_path):
    """(recording, PDUs in it): bursts at random times."""
    rng = np.random.default_rng(2)
    writer = RecordingWriter(tmp_path / "rec", "cf32_le", RATE, TUNING.frequency_hz)
    at, sent = 0, []
    for k in range(N_BURSTS):
        sent.append(pdu(k))
        burst = phy.Transmitter().modulate(sent[-1:], 3) * np.float32(0.2)
        at += int(rng.integers(400, 3000))
        writer.write(at, burst)
        at += len(burst)
    writer.close()
    with IqRecording(tmp_path / "rec") as opened:
        yield opened, sent


def heard(path):
    with IqRecording(path) as again:
        events = [event for event, _ in again.decode(None, lambda _: None)]
    return [event for event in events if isinstance(event, phy.PduHeard)]


@pytest.mark.parametrize("paced", [True, False])
async def test_bursts_are_recorded_as_far_apart_as_they_were(tmp_path, recording, paced):
    opened, sent = recording
    plan = plan_replay(opened, RATE, None, None, lambda _: None)
    assert len(plan.stretches) == N_BURSTS
    wish = CaptureWish(tmp_path / "again", "ci16_le", None, None, phy.OFDM_64_16)
    folder = tmp_path / "air"
    capture = Capture(EtherRadio(hub_in(folder), LISTENER, "who records"), TUNING, wish)
    replay = Replay(EtherRadio(hub_in(folder), NODE, "who sends"), TUNING, opened, plan, 1)
    recorded, moved = [0.0], asyncio.Event()

    def watch(state):
        recorded.append(state.recorded_s)
        moved.set()

    with serving(folder, RADIOS, paced):
        async with asyncio.timeout(60), capture, replay:
            recording_it = asyncio.ensure_future(capture.run(watch))
            report = await replay.run(lambda _: None)
            # In lock-step, the recorder has heard everything that has left, and hears nothing more
            # alone.
            until_s = recorded[-1] + 0.2
            while paced and recorded[-1] < until_s:
                moved.clear()
                await moved.wait()
            capture.stop()
            made = await recording_it
    assert (report.sent, report.slipped) == (N_BURSTS, 0)
    assert (made.n_bursts, made.pdus_good, made.problem) == (N_BURSTS, N_BURSTS, "")
    again = heard(tmp_path / "again")
    assert [each.data for each in again] == sent
    begins = np.diff([each.burst.start for each in again])
    assert np.abs(begins - np.diff([each.start for each in plan.stretches])).max() <= 33
    assert made.n_gaps == 0
