"""The hub: radios of other processes on one simulated air, paced or in lock-step."""

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from random import Random

import msgspec

from backends.base import Samples, TxBurst
from backends.ether import protocol
from backends.ether.ear import Piece
from backends.ether.medium import Medium
from backends.ether.sockets import HubSockets
from backends.ether.world import AirParams, RadioParams, World
from backends.hub_address import HubAddress

TRAVEL_S = 0.0003
"""A burst reaches the hub this long before it begins, so that it can reach the other radios."""
# In lock-step, the hub checks a radio that is silent for this long.
LOOK_AFTER_MS = 500
LARGEST_INDEX = 1 << 62


@dataclass
class _Member:
    """One radio on the hub's air."""

    node: int
    identity: bytes
    who: str
    token: int
    done: int = 0
    late: int = 0
    placed: list[protocol.Placed] = field(default_factory=list)
    notice: str = ""


class EtherHub:
    """A hub: sockets in `directory` and at `listen`. `radios` are expected; others get defaults.

    Paced, the radios keep the time, and the hub forwards what they send. In lock-step it starts
    when all expected radios have joined; each step waits for every radio. It stops at `until_s`.
    """

    def __init__(
        self,
        directory: Path,
        air: AirParams,
        world: World,
        radios: Mapping[int, RadioParams],
        *,
        paced: bool = True,
        until_s: float = float("inf"),
        seed: int = 0,
        listen: HubAddress | None = None,
    ) -> None:
        self._air = air
        self._radios = radios
        self._expected = set(radios)
        self._paced = paced
        self._until_s = until_s
        self._seed = seed
        self.medium = Medium(air, world, seed)
        """The air itself."""
        self._members: dict[int, _Member] = {}
        self._by_token: dict[int, _Member] = {}
        self._tokens = Random()
        # In lock-step bursts arrive in random order, so they are collected and sorted.
        self._bursts: list[tuple[int, int, TxBurst, int]] = []
        self._now = 0.0
        self._step = 0
        self._looked = 0.0
        self._began = 0.0
        self._bursts_lost = 0
        self._is_stopped = False
        self._sockets = HubSockets(directory, listen)

    def stop(self) -> None:
        """End `run`; may be called from a signal handler."""
        self._is_stopped = True

    def run(self, ready: Callable[[], None] = lambda: None) -> None:
        """Serve the air until the hub is stopped."""
        ready()
        try:
            if self._paced:
                self._run_paced()
            else:
                self._run_in_lockstep()
        finally:
            self._sockets.close()

    def _run_paced(self) -> None:
        self._began = time.monotonic() - self._now
        while not self._is_stopped:
            self._sockets.wait(LOOK_AFTER_MS)
            # In whole samples, so that clocks of equal crystals are in step.
            now_s = time.monotonic() - self._began
            self._now = math.floor(now_s * self._air.rate_hz) / self._air.rate_hz
            self._sockets.take(self._take_from_radio, self._take_request)

    def _run_in_lockstep(self) -> None:
        while not self._is_stopped:
            behind = [member for member in self._members.values() if member.done < self._step]
            is_complete = self._members.keys() >= self._expected
            if behind or not is_complete or not self._members or self._is_over:
                self._sockets.wait(LOOK_AFTER_MS)
                if time.monotonic() - self._looked > 1e-3 * LOOK_AFTER_MS:
                    self._looked = time.monotonic()
                    self._look_for(behind)
                self._sockets.take(self._take_from_radio, self._take_request)
                continue
            for bursts in sorted(self._bursts, key=lambda each: each[:2]):
                self._send(*bursts)
            self._bursts.clear()
            self._step += 1
            self._looked = time.monotonic()
            self._now = min(self._step * self._air.block_s, self._until_s)
            self._hand_out()

    @property
    def _is_over(self) -> bool:
        return self._now >= self._until_s

    def _take_request(self, frames: list[bytes]) -> None:
        identity, data = frames[0], frames[-1]
        message = protocol.to_hub(data)
        if isinstance(message, protocol.Question):
            self._reply(identity, self._answer())
        else:
            self._reply(identity, self._admit(identity, message))

    def _admit(self, identity: bytes, hello: protocol.Hello) -> msgspec.Struct:
        reason = self._refusal(identity, hello)
        if reason:
            return protocol.Refused(reason=reason)
        gone = self._members.pop(hello.node, None)
        if gone is not None:
            self._by_token.pop(gone.token)
        token = self._tokens.getrandbits(53)
        member = _Member(hello.node, identity, hello.who, token, self._step or -1)
        self._members[hello.node] = self._by_token[token] = member
        radio = self._radios.get(hello.node, RadioParams())
        self.medium.leave(hello.node)
        self.medium.join(hello.node, radio, self._now)
        return protocol.Welcome(
            token=token,
            radio=radio,
            seed=self._seed * 256 + hello.node,
            block_s=self._air.block_s,
            host_ns=round(1e9 * (self._began + self._now)),
            paced=self._paced,
            jammers=self._air.jammer,
            air=f"{self._air.profile} air of {self._air.rate_hz / 1e6:g} Msps"
            + ("" if self._paced else ", lock-step"),
        )

    def _refusal(self, identity: bytes, hello: protocol.Hello) -> str:
        if hello.version != protocol.VERSION:
            return (
                f"this hub speaks version {protocol.VERSION} of the ether protocol, the radio "
                f"version {hello.version}; run hub and daemons from the same sdrlinkd version"
            )
        for name, theirs, ours in (
            ("rate_hz", hello.rate_hz, self._air.rate_hz),
            ("frequency_hz", hello.frequency_hz, self._air.frequency_hz),
        ):
            if not abs(theirs - ours) <= 1e-6 * ours:
                return f"modem.{name}: got {theirs:g}; allowed: {ours:g}, as on this channel"
        there = self._members.get(hello.node)
        if there is not None and there.identity != identity and self._is_alive(there):
            there.notice = (
                f"another daemon requested our id {hello.node} on this channel and was refused: "
                f"{hello.who}; give it another robot_id"
            )
            if self._paced:
                self._reply(there.identity, protocol.News(notice=there.notice))
            return (
                f"robot {hello.node} is already on this channel: {there.who}; give one of the two "
                "another robot_id"
            )
        if not self._paced and self._step and there is None:
            return f"robot {hello.node} joined too late: in lock-step all robots start together"
        return ""

    def _take_from_radio(self, frames: list[bytes]) -> None:
        message = protocol.from_radio(frames[0])
        member = self._by_token.get(message.token)
        if member is None:
            return
        if isinstance(message, protocol.Done):
            member.done = max(member.done, message.step)
        elif isinstance(message, protocol.Bye):
            # The radio may be waiting for a message.
            self._reply(member.identity, self._answer())
            self._remove(member)
        else:
            samples = protocol.samples_in(frames)
            if samples is None or not len(samples):
                return
            burst = TxBurst(message.start, samples, message.latest)
            if self._paced:
                self._forward(member, message, burst)
            else:
                late_seen = message.late_seen
                self._bursts.append((member.node, message.number, burst, late_seen))

    def _forward(self, member: _Member, sent: protocol.Sent, burst: TxBurst) -> None:
        """In real time: send a burst to those who hear it, and tell the sender where it is."""
        self.medium.pass_time(member.node, self._now + TRAVEL_S)
        may_leave = self._may_leave(member, burst, sent.late_seen)
        start, arrivals = self.medium.place(member.node, burst) if may_leave else (None, [])
        for node, at, way in arrivals:
            there = self._members.get(node)
            # What is too far away to be numbered, or has no power that can be told, never arrives.
            if there is not None and abs(at) < LARGEST_INDEX and math.isfinite(way.loss_db):
                message = protocol.Arriving(sender=member.node, at=at, way=way)
                if not self._reply(there.identity, message, burst.samples):
                    self._bursts_lost += 1
        member.late += start is None
        placed = [protocol.Placed(sent.number, start, len(burst.samples))]
        self._reply(member.identity, protocol.News(placed=placed))

    def _send(self, node: int, number: int, burst: TxBurst, late_seen: int) -> None:
        """In lock-step: put a burst on the air."""
        member = self._members.get(node)
        if member is not None:
            start = None
            if self._may_leave(member, burst, late_seen):
                start = self.medium.send(node, burst)
            member.late += start is None
            member.placed.append(protocol.Placed(number, start, len(burst.samples)))

    def _may_leave(self, member: _Member, burst: TxBurst, late_seen: int) -> bool:
        """Whether a burst overtakes none that was late and has to be sent again."""
        return burst.latest is None or late_seen == member.late

    def _hand_out(self) -> None:
        """In lock-step: hand out the step to all radios."""
        pieces = {node: self.medium.take(node, self._now) for node in self._members}
        for member in list(self._members.values()):
            each = pieces[member.node] or [Piece(0, None, is_deaf=False)]
            for i, piece in enumerate(each):
                is_last = i == len(each) - 1
                stretch = protocol.Stretch(
                    n=piece.n,
                    is_deaf=piece.is_deaf,
                    step=self._step if is_last else 0,
                    placed=member.placed,
                    notice=member.notice,
                )
                # A radio in lock-step has read everything before it is done.
                self._reply(member.identity, stretch, piece.samples)
                member.placed, member.notice = [], ""

    def _reply(
        self, identity: bytes, message: msgspec.Struct, samples: Samples | None = None
    ) -> bool:
        """Send without waiting; False when there was no room for the message."""
        try:
            return self._sockets.reply(identity, message, samples)
        except ConnectionError:
            for member in list(self._members.values()):
                if member.identity == identity:
                    self._remove(member)
            return True

    def _look_for(self, behind: list[_Member]) -> None:
        """Detect killed daemons: they send no Bye, but their connection is gone."""
        for member in behind:
            self._is_alive(member)

    def _is_alive(self, member: _Member) -> bool:
        self._reply(member.identity, self._answer())
        return self._members.get(member.node) is member

    def _remove(self, member: _Member) -> None:
        if self._members.get(member.node) is member:
            del self._members[member.node]
            self.medium.leave(member.node)
        self._by_token.pop(member.token, None)
        # An air in lock-step does not wait for a radio that has left.
        self._expected.discard(member.node)

    def _answer(self) -> protocol.Answer:
        return protocol.Answer(
            now_s=self._now,
            nodes={node: member.who for node, member in sorted(self._members.items())},
            is_over=self._is_over,
            bursts=self.medium.bursts,
            bursts_late=self.medium.bursts_late,
            bursts_lost=self._bursts_lost,
            paced=self._paced,
            host_ns=time.monotonic_ns(),
        )
