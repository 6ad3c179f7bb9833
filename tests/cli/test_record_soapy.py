"""`record` and `replay` through SoapySDR: the test radio of tests/soapy_loopback, in real time."""

import asyncio
import contextlib
import signal
import uuid

import numpy as np
import pytest
import sigmf

import phy
from backends import SoapyRadio, SoapySettings, Tuning, TxBurst, TxOutcome
from sdrlinkd.cli import run
from sdrlinkd.iq import Capture, CaptureWish, IqRecording, Replay, plan_replay
from sdrlinkd.process import wait_until
from tests.iq.recordings import pdu, write_bursts
from tests.programs import sdrlinkctl
from tests.soapy_loopback import Bus, missing, module_folder

RATE_HZ, FREQUENCY_HZ = 1e6, 2.4e9
TUNING = Tuning(RATE_HZ, FREQUENCY_HZ)
PATIENCE_S = 60
ATTEMPTS = 3
"""A busy machine may lose samples, or be late, so tests are repeated up to this number."""


@pytest.fixture
def device(monkeypatch):
    """Device arguments for an air of this test alone, by unit."""
    if why := missing():
        pytest.skip(why)
    monkeypatch.setenv("SOAPY_SDR_PLUGIN_PATH", str(module_folder()))
    # With an empty root SoapySDR loads no other driver: this is faster, and quiet.
    monkeypatch.setenv("SOAPY_SDR_ROOT", "/nonexistent")
    name = f"record-{uuid.uuid4().hex[:12]}"
    with Bus(name):
        # Tolerates a second of delay on a busy machine.
        yield (
            lambda unit: (
                f"driver=loopback,model=usrp,bus={name},unit={unit},noise_db=-50,rxbuf=1000000"
            )
        )


def radio(device, unit, **changes):
    """A radio that receives at the level of the sender."""
    gains = {"rx_gain_db": 20, "tx_gain_db": 40, "tx_enabled": True} | changes
    settings = SoapySettings(device=device(unit), rate_hz=0, frequency_hz=0, **gains)
    return SoapyRadio(settings, longest_s=0.25)


class Recording:
    """A recording in progress; entered when the radio is heard."""

    def __init__(self, device, unit, path):
        wish = CaptureWish(path, "ci16_le", None, None, phy.OFDM_64_16)
        self._capture = Capture(radio(device, unit, tx_enabled=False), TUNING, wish)
        self._recorded_s = 0.0
        self._moved = asyncio.Event()
        self.report = None

    async def __aenter__(self):
        self._task = asyncio.ensure_future(self._run())
        await self._heard(0.0)
        return self

    async def __aexit__(self, *_):
        # A signal is recorded once as much more is recorded as may be in flight.
        await self._heard(self._recorded_s + 0.3)
        self._capture.stop()
        self.report = await self._task

    async def _run(self):
        async with self._capture as capture:
            return await capture.run(self._watch)

    def _watch(self, state):
        self._recorded_s = state.recorded_s
        self._moved.set()

    async def _heard(self, after_s):
        async with asyncio.timeout(PATIENCE_S):
            while self._recorded_s <= after_s:
                self._moved.clear()
                await self._moved.wait()


@contextlib.asynccontextmanager
async def on_the_air(sender):
    """Open the radio and take its stream; yields a function for its current index."""
    at = asyncio.get_running_loop().create_future()

    async def take():
        async for block in sender.blocks():
            if not at.done():
                at.set_result(block.index + block.n)

    await sender.open(TUNING)
    task = asyncio.ensure_future(take())
    try:
        yield await at
    finally:
        await sender.close()
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


def decoded(path):
    with IqRecording(path) as recording:
        events = [event for event, _ in recording.decode(None, lambda _: None)]
    return [event.data for event in events if isinstance(event, phy.PduHeard)]


def annotated(path):
    """(start, length) of each burst, read by SigMF's package, which must find the file valid."""
    theirs = sigmf.fromfile(f"{path}.sigmf-meta")
    theirs.validate()
    return np.array(
        [
            (each["core:sample_start"], each["core:sample_count"])
            for each in theirs.get_annotations()
            if each["core:label"] == "burst"
        ]
    )


def begins_at(path, near, burst):
    """Start of a burst with these samples, found by correlation."""
    with IqRecording(path) as recording:
        x = recording.read(near - 200, len(burst) + 400)
    return near - 200 + int(np.abs(np.correlate(x, burst, "valid")).argmax())


@pytest.mark.realtime
async def test_what_is_heard_is_annotated_to_the_sample_and_heard_again_when_replayed(
    device, tmp_path
):
    rng = np.random.default_rng(3)
    mcs_list = [1, 3, 6, 0, 2, 4]
    sent = [[pdu(2 * k), pdu(2 * k + 1)] for k in range(len(mcs_list))]
    bursts = [
        phy.Transmitter().modulate(pdus, mcs) * np.float32(0.2)
        for pdus, mcs in zip(sent, mcs_list, strict=True)
    ]
    starts = np.cumsum([0, *(len(each) for each in bursts[:-1])])
    starts += np.cumsum(rng.integers(400, 30_000, len(bursts)))
    for attempt in range(ATTEMPTS):
        path = tmp_path / f"rec{attempt}"
        sender = radio(device, 0)
        async with Recording(device, 1, path) as made, on_the_air(sender) as now:
            first = now + round(0.2 * RATE_HZ)
            answers = [
                sender.send(TxBurst(first + int(start), burst))
                for start, burst in zip(starts, bursts, strict=True)
            ]
            async with asyncio.timeout(PATIENCE_S):
                reports = await asyncio.gather(*answers)
        outcomes = {each.outcome for each in reports}
        if outcomes == {TxOutcome.SENT} and not made.report.n_gaps:
            break
    assert (outcomes, made.report.n_gaps) == ({TxOutcome.SENT}, 0), "too busy a machine"
    assert (made.report.pdus_bad, made.report.problem) == (0, "")
    flat = [each for pdus in sent for each in pdus]
    assert decoded(path) == flat
    told = annotated(path)
    assert told[:, 1].tolist() == [len(each) for each in bursts]
    assert np.abs(np.diff(told[:, 0]) - np.diff(starts)).max() <= 2
    for (start, _), burst in zip(told, bursts, strict=True):
        assert abs(start - begins_at(path, start, burst)) <= 2

    with IqRecording(path) as recording:
        plan = plan_replay(recording, RATE_HZ, None, 15, lambda _: None)
        for attempt in range(ATTEMPTS):
            sending = Replay(radio(device, 3), TUNING, recording, plan, times=2)
            again_path = tmp_path / f"again{attempt}"
            async with Recording(device, 2, again_path) as heard, sending as replay:
                report = await replay.run(lambda _: None)
            if (report.sent, report.slipped, heard.report.n_gaps) == (12, 0, 0):
                break
    assert (report.sent, report.slipped, heard.report.n_gaps) == (12, 0, 0), "too busy a machine"
    assert (report.n_bursts, heard.report.pdus_bad) == (12, 0)
    assert decoded(again_path) == flat + flat
    again = annotated(again_path)
    for turn in (again[:6], again[6:]):
        assert np.array_equal(turn[:, 1], told[:, 1])
        assert np.abs(np.diff(turn[:, 0]) - np.diff(told[:, 0])).max() <= 2


@pytest.mark.realtime
def test_the_commands_do_the_same(device, tmp_path, capsys):
    sent = write_bursts(tmp_path / "made")
    given = ("--frequency", "2.4e9", "--rate", "2e6", "--gain")
    data = tmp_path / "rec.sigmf-data"
    with sdrlinkctl("record", tmp_path / "rec", "--device", device(1), *given, "20") as record:
        wait_until(lambda: data.exists() and data.stat().st_size > 10_000, PATIENCE_S, record)
        replay = ["replay", str(tmp_path / "made"), "--device", device(0), *given, "40"]
        assert run([*replay, "--transmit"]) == 0
        assert capsys.readouterr().out.startswith(
            "sent 3 of 3 stretches; silence between them is below -"
        )
        # The recording contains what was sent once it is longer by what may be in flight.
        size = data.stat().st_size
        enough = size + 4 * round(0.3 * 2e6)
        wait_until(lambda: data.stat().st_size > enough, PATIENCE_S, record)
        code = record.stop(signal.SIGINT, PATIENCE_S)
    assert (code, record.err()) == (0, "")
    assert "bursts    3, 6 PDUs good, 0 bad" in record.out()
    assert decoded(tmp_path / "rec") == sent
    assert len(annotated(tmp_path / "rec")) == 3
    assert "loopback usrp, 2400 MHz, rx 20 dB, tx_enabled = false" in sigmf.fromfile(
        f"{tmp_path}/rec.sigmf-meta"
    ).get_global_field("core:hw")


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"--rate": "100e6"}, "allowed by this device: 0.2 to 61.44 Msps"),
        ({"--frequency": "10e6"}, "modem.frequency_hz: got 10 MHz at the radio's oscillator; allo"),
        ({"--gain": "99"}, "soapy.rx_gain_db: got 99 dB; allowed by this device: 0 to 76 dB"),
        ({"--gains": "LNA=3"}, 'soapy.rx_gains: got "LNA"; allowed by this device: "PGA"'),
        ({"--antenna": "up"}, 'soapy.rx_antenna: got "up"; allowed by this device: "TX/RX", "RX2"'),
    ],
)  # fmt: skip
def test_what_the_device_does_not_take_is_refused(device, tmp_path, capsys, changes, says):
    given = {"--device": device(0), "--rate": "1e6", "--frequency": "2.4e9"} | changes
    arguments = [part for pair in given.items() for part in pair]
    assert run(["record", str(tmp_path / "rec"), *arguments]) == 2
    out, err = capsys.readouterr()
    assert says in err
    assert (out, err.count("\n")) == ("", 1)
    assert not list(tmp_path.iterdir())
