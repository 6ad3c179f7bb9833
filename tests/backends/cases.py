"""Every kind of radio, set up in a folder."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from backends import IqFileRadio, LoopbackRadio, Radio, RadioParams, SoapyRadio, SoapySettings
from backends.testing import NOISE_DBFS
from tests.backends.echo import ZmqEcho
from tests.backends.hubs import SNR_DB, RadioOnHub, free_hub_port
from tests.backends.radios import AIR, BLOCK_S, PLAYED, N, heard, read, record
from tests.soapy_loopback import missing

TURNAROUND_S = 0.001


@dataclass(frozen=True)
class Case:
    """A radio under test."""

    name: str
    make: Callable[[Path], Radio]
    receives: bool = True
    transmits: bool = True
    paced: bool = False
    hears_self: bool = False
    plays: bool = False
    lockstep: bool = False
    full_duplex: bool = True
    turnaround_s: float = 0.0
    begin: int = 0
    """First index at which bursts handed over right after opening are in time."""
    gap_noise: float = 0.0
    """Maximum noise that is received when nothing was sent."""
    settles_with_blocks: bool = True
    """Whether reports come with the block in which a burst ends, not from the device."""
    snr_db: float | None = None
    """SNR of arriving bursts, whatever their power; None: they arrive unchanged, without noise."""

    def __str__(self):
        return self.name

    @property
    def backend(self):
        """The radio's name in the table of backends."""
        return self.name.split("-")[0]

    @property
    def noise(self):
        """A limit that no sample of noise alone exceeds."""
        return self.gap_noise if self.snr_db is None else 7 * 10 ** (NOISE_DBFS / 20)

    def gain(self, burst):
        """Gain of an arriving burst."""
        if self.snr_db is None:
            return 1.0
        return 10 ** ((NOISE_DBFS + self.snr_db) / 20) / np.sqrt(
            np.mean(np.abs(burst.samples) ** 2)
        )

    def recorded(self, folder, blocks):
        """The bursts that were sent: the closed radio's recording, or what it heard."""
        if self.hears_self:
            return heard(blocks)
        return read(folder / "sent")


def loopback(name, paced):
    return Case(name, lambda _: LoopbackRadio(AIR, BLOCK_S, paced), paced=paced, hears_self=True)


def iqfile(name, receives, transmits, paced=False):
    def make(folder):
        if receives:
            record(folder / "played", PLAYED)
        return IqFileRadio(
            folder / "played" if receives else None,
            folder / "sent" if transmits else None,
            AIR,
            BLOCK_S,
            paced,
            type_name="cf32_le",
        )

    return Case(name, make, receives, transmits, paced, plays=receives)


def ether(name, paced, full_duplex, is_remote=False):
    turnaround_s = 0.0 if full_duplex else TURNAROUND_S
    params = RadioParams(full_duplex=full_duplex, turnaround_s=turnaround_s)
    return Case(
        name,
        lambda folder: RadioOnHub(folder, params, paced, free_hub_port() if is_remote else None),
        paced=paced,
        lockstep=not paced,
        full_duplex=full_duplex,
        turnaround_s=turnaround_s,
        begin=10_000 if paced else 1000,
        snr_db=SNR_DB,
    )


def soapy(name, stamps):
    """A device that hears itself; with stamps, it sends bursts at given times."""
    can = "time=yes,ack=yes" if stamps else "time=no,ack=no"
    settings = SoapySettings(
        device=f"driver=loopback,model=plain,self=yes,noise_db=-200,mtu={N},{can}",
        rate_hz=0.0, frequency_hz=0.0, block_s=BLOCK_S, tx_enabled=True, tx_gain_db=40.0,
        rx_gain_db=20.0, dc_block=False,
    )  # fmt: skip

    def make(_):
        return SoapyRadio(settings, longest_s=0.1)

    return Case(
        name, make, paced=True, hears_self=True, begin=10_000, settles_with_blocks=False,
        gap_noise=1e-4,
    )  # fmt: skip


def zmq(name, pattern):
    """A ZeroMQ radio with a peer that echoes the samples."""
    return Case(
        name, lambda folder: ZmqEcho(folder, pattern), paced=True, hears_self=True, begin=10_000
    )


RADIOS = (
    loopback("loopback", paced=True),
    loopback("loopback-unpaced", paced=False),
    iqfile("iqfile-receives", receives=True, transmits=False),
    iqfile("iqfile-transmits", receives=False, transmits=True),
    iqfile("iqfile-both", receives=True, transmits=True),
    iqfile("iqfile-both-paced", receives=True, transmits=True, paced=True),
    ether("ether", paced=True, full_duplex=True),
    ether("ether-half-duplex", paced=True, full_duplex=False),
    ether("ether-lockstep", paced=False, full_duplex=True),
    ether("ether-lockstep-half-duplex", paced=False, full_duplex=False),
    ether("ether-remote", paced=True, full_duplex=False, is_remote=True),
    ether("ether-remote-lockstep", paced=False, full_duplex=True, is_remote=True),
    soapy("soapy", stamps=True),
    zmq("zmq-push", "push"),
    zmq("zmq-req", "req"),
)

NEEDS = {"soapy": pytest.mark.skipif(bool(missing()), reason=missing())}


def _those(applies):
    cases = [
        pytest.param(case, marks=NEEDS.get(case.name, ()), id=str(case))
        for case in RADIOS
        if applies(case)
    ]
    return pytest.mark.parametrize("case", cases)


every_radio = _those(lambda _: True)
players = _those(lambda case: case.plays)
transmitters = _those(lambda case: case.transmits)
transceivers = _those(lambda case: case.transmits and case.receives)
not_in_lockstep = _those(lambda case: not case.lockstep)


def assert_only(case, recorded, sent):
    """Assert that `recorded` contains each (burst, report) once, apart from phase and scale."""
    rest = recorded.copy()
    for burst, report in sent:
        got = recorded[report.start : report.end]
        gain = np.vdot(burst.samples, got) / np.vdot(burst.samples, burst.samples)
        assert np.abs(gain) == pytest.approx(case.gain(burst), rel=1e-5 + 10 * case.noise)
        assert np.abs(got - gain * burst.samples).max() < 1e-5 + case.noise
        rest[report.start : report.end] = 0
    assert np.abs(rest).max(initial=0) <= case.noise
