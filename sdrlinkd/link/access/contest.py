"""A contest by pulses: of several robots that would send, exactly one finds out that it may."""

from sdrlinkd.link.qos import Qos

CLASS_BITS, WAITED_BITS = 2, 1


def n_bits(n: int) -> int:
    """Number of bits of a contest among `n` robots: for class, long wait, and robot."""
    return CLASS_BITS + WAITED_BITS + max(1, (n - 1).bit_length())


class Contest:
    """The part of one robot, the `rank`-th of `n`, in a contest for a message of class `qos`.

    In the slot of each bit, from the highest on, those whose bit is 1 send a pulse. Who hears one
    without sending one is out. More urgent classes win, among equals those that have waited for
    long, and then the lower rank.
    """

    def __init__(self, qos: Qos, rank: int, n: int, *, has_waited: bool) -> None:
        self._n_bits = n_bits(n)
        id_bits = self._n_bits - CLASS_BITS - WAITED_BITS
        first = (Qos.BULK - qos) << WAITED_BITS | has_waited
        self._code = first << id_bits | ((1 << id_bits) - 1 - rank)
        self.is_in = True
        """Whether we can still win."""

    def pulses(self, bit: int) -> bool:
        """Whether we send a pulse for the `bit`-th bit, counted from the highest."""
        return self.is_in and self._is_set(bit)

    def heard(self, bit: int) -> None:
        """Note that somebody else sent a pulse for a bit."""
        if not self._is_set(bit):
            self.is_in = False

    def _is_set(self, bit: int) -> bool:
        return bool(self._code >> (self._n_bits - 1 - bit) & 1)
