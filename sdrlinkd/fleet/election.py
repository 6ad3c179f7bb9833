"""Which gateway leads for a robot (fleet document, section 4)."""

from sdrlinkd.fleet.formats import TERMS, Claim, is_later

REPEAT_S = 0.3
LISTEN_S = 0.5
"""Time in s for which a gateway that has just heard of a robot waits for its leader's claim."""
BACK_OFF_S = 0.1
MARGIN = 0.1
FOR_S = 1.0
"""Time in s for which a gateway must be better by MARGIN before it takes over."""
GIVEN_UP = -1.0
MOST_SNR_DB = 40.0


def score(per: float, snr_db: float | None) -> float:
    """How well a gateway hears a robot: the share of its PDUs lost lately, and their SNR."""
    return (1 - per) + min(max(snr_db or 0.0, 0.0), MOST_SNR_DB) / (10 * MOST_SNR_DB)


class Election:
    """One gateway's part in the election for one robot; times in s."""

    def __init__(self, own_id: int, lease_s: float, now: float) -> None:
        self._own_id = own_id
        self._lease_s = lease_s
        self._score: float | None = None
        self._leader: Claim | None = None
        self._leader_at = now
        self._vacant_at: float | None = now + LISTEN_S
        """Since when there is no leader; None while there is one."""
        self._better_at: float | None = None
        self._said_at = float("-inf")
        self._term: int | None = None
        """The latest term so far; the first that is heard is believed, whatever it is."""

    @property
    def score(self) -> float | None:
        """How well this gateway hears the robot; None: not at all."""
        return self._score

    @property
    def leads(self) -> bool:
        """Whether this gateway leads."""
        return self._leader is not None and self._leader.gw == self._own_id

    @property
    def leader(self) -> int | None:
        """The gateway that leads; None if there is none."""
        return None if self._leader is None else self._leader.gw

    def hear(self, own_score: float | None, now: float) -> None:
        """Note how well this gateway hears the robot; None: not at all."""
        self._score = own_score
        leader = self._leader
        is_better = (
            own_score is not None
            and leader is not None
            and leader.gw != self._own_id
            and own_score > leader.score + MARGIN
        )
        if not is_better:
            self._better_at = None
        elif self._better_at is None:
            self._better_at = now

    def claimed(self, claim: Claim, now: float) -> None:
        """Take another gateway's claim."""
        if claim.gw == self._own_id:
            return
        if self._term is None or is_later(claim.term, self._term):
            self._term = claim.term
        leader = self._leader
        if claim.score <= GIVEN_UP:
            self.gone(claim.gw, now)
            return
        if leader is not None and leader.beats(claim) and claim.gw != leader.gw:
            if leader.gw == self._own_id:
                # Two lead: the other one has to know.
                self._said_at = float("-inf")
            return
        self._leader, self._leader_at, self._vacant_at = claim, now, None

    def gone(self, gateway: int, now: float) -> None:
        """Note that a gateway has gone, or hears the robot no longer."""
        if self._leader is not None and self._leader.gw == gateway != self._own_id:
            self._lose(now)

    def poll(self, now: float) -> Claim | None:
        """The claim to publish now, if any."""
        leader = self._leader
        if leader is not None and leader.gw == self._own_id:
            if self._score is None:
                self._lose(now)
                return self._say(leader.term, GIVEN_UP, now)
            if now < self._said_at + REPEAT_S:
                return None
            self._leader = self._say(leader.term, self._score, now)
            return self._leader
        if leader is not None and now > self._leader_at + self._lease_s:
            self._lose(now)
        if self._score is None:
            return None
        if self._vacant_at is not None:
            may_claim = now >= self._vacant_at + BACK_OFF_S * max(0.0, 1 - self._score)
        else:
            may_claim = self._better_at is not None and now >= self._better_at + FOR_S
        if not may_claim:
            return None
        self._better_at = self._vacant_at = None
        term = 0 if self._term is None else self._term
        self._leader = self._say((term + 1) % TERMS, self._score, now)
        self._leader_at = now
        return self._leader

    def _say(self, term: int, own_score: float, now: float) -> Claim:
        self._term, self._said_at = term, now
        return Claim(self._own_id, term, own_score)

    def _lose(self, now: float) -> None:
        self._leader, self._vacant_at, self._better_at = None, now, None
