"""Guaranteed shares of airtime, so that no class starves."""

from collections.abc import Collection, Sequence

from sdrlinkd.link.qos import Qos
from sdrlinkd.link.schedule.params import ClassesParams


class Shares:
    """The airtime credit of each class, in s.

    While messages of a class wait, it earns its share of every burst and pays for what it gets.
    Exceeding the share incurs no debt.
    """

    def __init__(self, params: ClassesParams) -> None:
        self._share = {qos: params.of(qos).share for qos in Qos}
        self._credit_s = dict.fromkeys(Qos, 0.0)
        self.is_owed = False
        """Whether any class has credit."""

    def spend(self, airtime_s: float, classes: Sequence[Qos], waiting: Collection[Qos]) -> None:
        """Settle a burst of length `airtime_s`.

        `classes` has the class of each of its PDUs, `waiting` the classes that still wait.
        """
        each_s = airtime_s / max(1, len(classes))
        for qos, share in self._share.items():
            if qos not in waiting:
                self._credit_s[qos] = 0.0
                continue
            earned_s = share * airtime_s - each_s * classes.count(qos)
            self._credit_s[qos] = max(0.0, self._credit_s[qos] + earned_s)
        self.is_owed = any(self._credit_s.values())

    def idle(self, passed_s: float, waiting: Collection[Qos]) -> None:
        """Credit the classes that waited while the channel was kept free for `passed_s`."""
        for qos in waiting:
            self._credit_s[qos] += self._share[qos] * passed_s
        self.is_owed = any(self._credit_s.values())

    def owed(self, pdu_s: float) -> list[Qos]:
        """Classes with credit, once for each PDU of length `pdu_s` that they are owed."""
        if pdu_s <= 0 or max(self._credit_s.values()) < pdu_s:
            return []
        n_pdus = ((qos, int(credit_s / pdu_s)) for qos, credit_s in self._credit_s.items())
        return [qos for qos, n in n_pdus for _ in range(n)]
