"""The protocol of one node. It takes times and frames, and returns frames; it never waits."""

from math import inf

from benchmarks.peers.pound.rtwmp.frames import (
    HEADER,
    MESSAGE,
    TOKEN,
    Ack,
    Authorization,
    Body,
    Claim,
    Drop,
    Frame,
    Message,
    Part,
    Token,
    size,
)
from benchmarks.peers.pound.rtwmp.lqm import Lqm
from benchmarks.peers.pound.rtwmp.messages import Joins, Queue
from benchmarks.peers.pound.rtwmp.params import Params
from benchmarks.peers.pound.rtwmp.routes import next_hop

Frames = list[Frame]
NOBODY: frozenset[int] = frozenset()


class Node:
    """Node `number` of `n_nodes`, from 0.

    Who drives it calls `hear` for each frame on the air that the node hears, `sent` when a frame
    of the node has left, and `expire` when `due` is reached.
    """

    def __init__(self, number: int, n_nodes: int, params: Params) -> None:
        self.number, self.n_nodes, self._params = number, n_nodes, params
        self.lqm = Lqm(number, n_nodes)
        self.queue = Queue(params.queue_depth, params.part_octets)
        self.delivered: list[Message] = []
        """Messages that have come for this node; the driver takes them away."""
        self.silence_s = params.inactivity_s + number * params.inactivity_step_s
        self.due = self.silence_s
        """When `expire` is to be called, in s."""
        self._joins = Joins(params.part_octets)
        self._highest = 0
        self._loop = 0
        self._parent: int | None = None
        self._unanswered: Frame | None = None
        self._retries = 0
        self._searched, self._sought = 0, number
        longest = HEADER.size + max(MESSAGE.size + params.part_octets, TOKEN.size + n_nodes**2)
        self._ack_wait_s = params.hop_s(longest) + params.ack_margin_s

    def start(self, now: float) -> Frames:
        """Make the first token of a network."""
        return self._new_token(None, now)

    def push(self, message: Message) -> bool:
        """Put a message into the queue; False if it is full."""
        return self.queue.push(message)

    def wants(self, frame: Frame) -> bool:
        """Whether a frame that this node has returned is still worth sending."""
        return frame is self._unanswered or isinstance(frame.body, Drop)

    def sent(self, frame: Frame, now: float) -> None:
        """Wait until another node is heard to go on: that is the acknowledgement."""
        if frame is self._unanswered:
            self.due = now + self._ack_wait_s

    def hear(self, frame: Frame, quality: float, now: float) -> Frames:
        """Take a frame from the air, to this node or to another; `quality` is in per cent."""
        self.lqm.hear(frame.sender, quality, now)
        if isinstance(frame.body, Drop):
            waits = self._unanswered
            if frame.to == self.number and waits and frame.body.serial == waits.serial:
                # Not its sender's serial: that may be of a frame that has not come here yet.
                self._yield(self._highest, now)
            return []
        if frame.serial <= self._highest:
            # Its sender has not heard how the token went on, or holds a second one.
            if frame.to != self.number:
                return []
            answer = Frame(self._highest, self.number, frame.sender, self._loop, Drop(frame.serial))
            return [answer]
        self._yield(frame.serial, now)
        if isinstance(frame.body, Token):
            self.lqm.take(frame.body.lqm, frame.sender)
        if frame.to != self.number:
            return []
        self._loop = frame.loop
        match frame.body:
            case Token() as token:
                return self._on_token(token, frame, now)
            case Authorization(dst) as authorization:
                if dst == self.number:
                    return self._send_part(now)
                return self._on(authorization, dst, now)
            case Part() as part:
                return self._on_part(part, now)

    def expire(self, now: float) -> Frames:
        """Act on a time that has run out: for an answer, for a try, or of silence."""
        if now < self.due:
            return []
        if (frame := self._unanswered) is not None:
            return self._on_no_answer(frame, now)
        # Alone, or nobody was heard: the last who had the token is gone with who sent it there.
        return self._new_token(None, now)

    def _yield(self, serial: int, now: float) -> None:
        """Leave the token to others, and listen."""
        self._highest = serial
        self._unanswered = None
        self.due = now + self.silence_s

    def _on_no_answer(self, frame: Frame, now: float) -> Frames:
        is_search = isinstance(frame.body, Token) and frame.to in frame.body.lost
        if self._retries < self._params.retries and not is_search:
            self._retries += 1
            self._unanswered = frame._replace(retry=True)
            self.due = inf
            return [self._unanswered]
        self._unanswered = None
        self.lqm.fail(frame.to)
        if isinstance(frame.body, Token):
            reached = frame.body.reached | {frame.to}
            return self._pass_on(frame.body._replace(reached=reached), now)
        # The source finds its part unconfirmed in this loop, and sends it again.
        return self._new_token(None, now)

    # The priority arbitration phase (PAP).

    def _new_token(self, ack: Ack | None, now: float) -> Frames:
        self._loop += 1
        self._parent = None
        self.lqm.age(now, self._params.hold_s)
        others = set(range(self.n_nodes)) - {self.number}
        # Who has no path is lost. The program asks for a link instead: halves of a network that
        # have lost each other would then never search.
        lost = frozenset(others - self.lqm.reachable())
        claim = self._claim(None, now)
        return self._pass_on(
            Token(self.number, claim, frozenset({self.number}), lost, (), ack), now
        )

    def _on_token(self, token: Token, frame: Frame, now: float) -> Frames:
        if self.number not in token.reached:
            self._parent = frame.sender
        if token.ack is not None and token.ack.src == self.number:
            self.queue.confirm(token.ack)
            token = token._replace(ack=None)
        if token.claim is not None:
            passed_s = self._params.hop_s(size(token, self.n_nodes))
            older = token.claim.age_s + passed_s
            token = token._replace(claim=token.claim._replace(age_s=older))
        return self._pass_on(
            token._replace(
                claim=self._claim(token.claim, now),
                reached=token.reached | {self.number},
                lost=token.lost - {self.number},
            ),
            now,
        )

    def _claim(self, claim: Claim | None, now: float) -> Claim | None:
        """The more important of the claim so far and of my first message."""
        mine = self.queue.head(self._can_reach)
        if mine is None:
            return claim
        my_claim = Claim(mine.message.priority, now - mine.message.at, self.number)
        if claim is None or my_claim[:2] > claim[:2]:
            return my_claim
        return claim

    def _pass_on(self, token: Token, now: float) -> Frames:
        """Send the token to its next node, or end the phase."""
        me = self.number
        if (sought := self._search(token)) is not None:
            return self._send(sought, token)
        if self._is_alone():
            # Two that are alone do not try in step.
            self.due = now + self._params.rest_s * (1 + me / self.n_nodes)
            return []
        missing = set(range(self.n_nodes)) - token.reached - token.lost
        if not missing and self._params.returns and not token.returning and token.beginner != me:
            token = token._replace(reached=token.reached - {token.beginner}, returning=True)
            missing = {token.beginner}
        near = [(self.lqm.link(me, node), -node) for node in missing]
        if near and (best := max(near))[0] > 0:
            return self._send(-best[1], token)
        if missing and self._parent is not None:
            return self._send(self._parent, token)
        if token.claim is None:
            return self._new_token(token.ack, now)
        if token.claim.holder == me:
            return self._send_part(now)
        return self._on(Authorization(token.claim.holder, NOBODY), token.claim.holder, now)

    def _search(self, token: Token) -> int | None:
        """A lost node to which I send the token now, in case it is back: one in a loop at most."""
        lost = sorted(token.lost - token.reached)
        is_alone = len(token.lost) == self.n_nodes - 1
        turn, is_other = divmod(self._loop, self._params.search_loops)
        is_mine = is_alone or (not is_other and turn % self.n_nodes == self.number)
        if not lost or not is_mine or self._searched == self._loop:
            return None
        self._searched = self._loop
        self._sought = next((node for node in lost if node > self._sought), lost[0])
        return self._sought

    def _is_alone(self) -> bool:
        return not any(
            self.lqm.link(self.number, node) for node in range(self.n_nodes) if node != self.number
        )

    def _can_reach(self, dst: int) -> bool:
        return bool(self.lqm.link(self.number, dst)) or dst in self.lqm.reachable()

    # The phases of authorization (ATP) and message (MTP).

    def _send_part(self, now: float) -> Frames:
        # Not what the token has found, but the most important by now.
        head = self.queue.head(self._can_reach)
        if head is None:
            return self._new_token(None, now)
        return self._on(self.queue.part(head), head.message.dst, now)

    def _on_part(self, part: Part, now: float) -> Frames:
        message = part.message
        if message.dst != self.number:
            return self._on(part, message.dst, now)
        whole = self._joins.feed(part)
        if whole is not None:
            self.delivered.append(whole)
        return self._new_token(Ack(message.src, message.number, part.part), now)

    def _on(self, body: Authorization | Part, dst: int, now: float) -> Frames:
        """Send an authorization or a message one hop further."""
        reached = body.reached | {self.number}
        to = next_hop(self.lqm, self.number, dst, reached - {self.number})
        if to is None:
            return self._new_token(None, now)
        return self._send(to, body._replace(reached=reached))

    def _send(self, to: int, body: Body) -> Frames:
        if isinstance(body, Token):
            body = body._replace(lqm=self.lqm.matrix())
        self._highest += 1
        self._unanswered = Frame(self._highest, self.number, to, self._loop, body)
        self._retries = 0
        self.due = inf
        return [self._unanswered]
