"""What is fuzzed: for each name, a function that takes any bytes and raises nothing."""

import resource
import tempfile
import time
from collections.abc import Callable
from itertools import cycle
from pathlib import Path
from random import Random

import msgspec

from backends import BackendError, describe
from backends.testing import protocol
from sdrlinkd.bus import fields_of
from sdrlinkd.bus.testing import decode, wanted_of
from sdrlinkd.config import parse_config
from sdrlinkd.errors import ConfigError, EnvelopeError, PduError
from sdrlinkd.link import ClockParams, Outcome, RelayParams, RepeatParams
from sdrlinkd.pdulink import from_gnu_radio
from sdrlinkd.pdulink.testing import pmt
from sdrlinkd.sealing import Key, Remembered, Sealing, SecurityParams
from sdrlinkd.wire import (
    MIN_PDU_SIZE,
    build,
    build_records,
    lasting_identity,
    parse,
    parse_records,
    parse_sealed,
    postponed,
    read_control_entries,
)
from tests.fuzz import doors
from tests.link.world import make_link, next_burst

PDU_SIZE = 64
KEY = Key(1, bytes(range(32)))
NEW = Remembered({KEY.fingerprint: 0})
"""What is on disk of a key that was never used."""
STEP_S = 0.01
MOST_CPU_S, MOST_KIB = 2.0, 1 << 16
"""Most CPU time in s, and most memory in KiB, that an input may take."""
FORGET_AFTER = 400
"""A link starts anew after so many inputs, so that a crash can be repeated."""


def pdu(data: bytes) -> None:
    """One PDU of its size, or of another one."""
    try:
        fields = parse(data, max(MIN_PDU_SIZE, len(data)))
    except PduError:
        return
    assert build(fields, len(data)) == data
    control = read_control_entries(fields)
    assert 0 <= control.n_bad <= control.n_entries
    lasting_identity(data)
    assert len(postponed(data, 1234)) == len(data)


def records(data: bytes) -> None:
    """The payload of a control entry."""
    try:
        found = parse_records(data)
    except PduError:
        return
    assert parse_records(build_records(found)) == found


class Hearing:
    """A link that hears what comes, sends, repeats and relays; its ledger must always add up."""

    def __init__(self) -> None:
        self._n = FORGET_AFTER
        self._policies = cycle(("flood", "auto"))

    def __call__(self, data: bytes) -> None:
        """Hear PDUs of PDU_SIZE octets, one after the other."""
        if self._n >= FORGET_AFTER:
            self._n, self._now = 0, 0.0
            self._link = make_link(
                2, pdu_size=PDU_SIZE, beacon_s=1.0, clock=ClockParams(), repeat=RepeatParams(),
                relay=RelayParams(policy=next(self._policies)), hop_limit=3, has_numbers=True,
                seed=1,
            )  # fmt: skip
        self._n += 1
        link = self._link
        for at in range(0, max(1, len(data)), PDU_SIZE):
            self._now += STEP_S
            for message in link.hear(data[at : at + PDU_SIZE], self._now, 20.0):
                link.delivered(message, self._now)
            if self._n % 8 == 0:
                link.submit(0, b"\0\1\0\0" + bytes(80), self._now)
                link.handle_timers(self._now)
            burst = next_burst(link, self._now)
            if burst is not None:
                link.confirm(burst, Outcome.SENT, self._now)
                assert self._n % 64 or link.audit() == []


class Opening:
    """A robot with a key that opens what comes."""

    def __init__(self) -> None:
        self._n = FORGET_AFTER

    def __call__(self, data: bytes) -> None:
        """Open one sealed PDU."""
        if self._n >= FORGET_AFTER:
            self._n = 0
            self._sealing = Sealing(
                2,
                PDU_SIZE,
                SecurityParams(mode="seal"),
                [KEY],
                NEW,
                Random(1).randbytes,
            )
        self._n += 1
        at = STEP_S * self._n
        try:
            parse_sealed(data, PDU_SIZE)
            self._sealing.opener.open(data, at)
        except PduError:
            self._sealing.opener.refuses_clear(data, at)
        self._sealing.notices(at)


def bus(data: bytes) -> None:
    """Frames of the bus, divided by the octet 0xFF."""
    frames = data.split(b"\xff")
    for read in (decode, wanted_of, fields_of):
        try:
            read(frames)
        except EnvelopeError:
            continue


def config(data: bytes) -> None:
    """A configuration file."""
    try:
        parse_config(data.decode("utf-8", "replace"))
    except ConfigError:
        return


def gnu_radio(data: bytes) -> None:
    """A serialized PMT, and a PDU in it."""
    for read in (pmt.loads, from_gnu_radio):
        try:
            read(data)
        except ValueError:
            continue


def sigmf(data: bytes) -> None:
    """The metadata of a recording, beside some samples."""
    with tempfile.TemporaryDirectory() as name:
        meta = Path(name) / "x.sigmf-meta"
        meta.write_bytes(data)
        meta.with_suffix(".sigmf-data").write_bytes(bytes(64))
        try:
            describe(meta)
        except BackendError:
            return


def hub(data: bytes) -> None:
    """A message between a radio and the hub of a simulated air."""
    for read in (protocol.to_hub, protocol.from_hub, protocol.from_radio):
        try:
            read(data)
        except (msgspec.DecodeError, ValueError, RecursionError):
            # As the sockets catch them.
            continue


class Bounded:
    """A target of which no input may take long, or much memory."""

    def __init__(self, target: Callable[[bytes], None]) -> None:
        self._target = target

    def __call__(self, data: bytes) -> None:
        """Give it an input."""
        cpu_s, kib = time.thread_time(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        self._target(data)
        cpu_s = time.thread_time() - cpu_s
        kib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - kib
        assert cpu_s < MOST_CPU_S, f"{cpu_s:.1f} s for {len(data)} octets"
        assert kib < MOST_KIB, f"{kib} KiB for {len(data)} octets"


_TARGETS: dict[str, Callable[[bytes], None]] = {
    "pdu": pdu,
    "records": records,
    "link": Hearing(),
    "sealed": Opening(),
    "bus": bus,
    "config": config,
    "pmt": gnu_radio,
    "sigmf": sigmf,
    "hub": hub,
    "foxglove": doors.foxglove,
    "zenoh": doors.Zenoh(),
    "rmw_zenoh": doors.rmw_zenoh,
    "state": doors.state,
    "cdr": doors.cdr,
}
TARGETS = {name: Bounded(target) for name, target in _TARGETS.items()}
"""Targets by name."""
