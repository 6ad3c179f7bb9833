"""Guaranteed shares of the air, so that no class starves."""

from collections.abc import Collection, Sequence

from sdrlinkd.link.qos import Qos
from sdrlinkd.link.schedule.params import ClassesParams


class Shares:
    """What each class is owed, in s on the air.

    While something of a class waits, it earns its share of every burst and pays for what it gets;
    one that gets more than its share owes nothing later.
    """

    def __init__(self, params: ClassesParams) -> None:
        self._share = {qos: params.of(qos).share for qos in Qos}
        self._credit_s = dict.fromkeys(Qos, 0.0)
        self.is_owed = False
        """Whether any class has credit."""

    def spend(self, airtime_s: float, classes: Sequence[Qos], waiting: Collection[Qos]) -> None:
        """Settle a burst of that length: the class of each of its PDUs, and what still waits."""
        each_s = airtime_s / max(1, len(classes))
        for qos, share in self._share.items():
            if qos not in waiting:
                self._credit_s[qos] = 0.0
                continue
            earned_s = share * airtime_s - each_s * classes.count(qos)
            self._credit_s[qos] = max(0.0, self._credit_s[qos] + earned_s)
        self.is_owed = any(self._credit_s.values())

    def idle(self, passed_s: float, waiting: Collection[Qos]) -> None:
        """Credit classes that waited while the air was kept free for so long."""
        for qos in waiting:
            self._credit_s[qos] += self._share[qos] * passed_s
        self.is_owed = any(self._credit_s.values())

    def owed(self, pdu_s: float) -> list[Qos]:
        """A class for each PDU of that length that it has earned and did not get."""
        if pdu_s <= 0 or max(self._credit_s.values()) < pdu_s:
            return []
        n_pdus = ((qos, int(credit_s / pdu_s)) for qos, credit_s in self._credit_s.items())
        return [qos for qos, n in n_pdus for _ in range(n)]
