"""The duplicate filter, which also counts lost PDUs."""

WINDOW = 128


class SequenceTrack:
    """The sequence numbers of one source: duplicates within the last 128 PDUs, and known losses.

    Two PDUs are the same if sequence number and CRC (with the hop nibble taken as zero) are equal.
    Sequence numbers are modulo 256. A step of n, up to 127 ahead, means that n − 1 PDUs are lost.
    An older number that was missing is a late arrival. Any other older number means that the sender
    restarted, or was away for longer than the numbers can tell.

    A restarted sender may also continue with a number that looks like a step ahead. Only its boot
    id tells: `restart` takes back the largest step since `goes_on` last confirmed the old one.
    """

    __slots__ = ("_crc", "_leap", "_newest", "_position", "lost", "restarts")

    def __init__(self) -> None:
        self._newest = -1
        # By sequence number: the CRC last heard, and its extended position.
        self._crc = [-1] * 256
        self._position = [-(WINDOW + 1)] * 256
        # The most losses that one step has shown since the source's boot id was last confirmed.
        self._leap = 0
        self.lost = 0
        self.restarts = 0

    def heard(self, seq: int, crc: int) -> bool:
        """Note a PDU; False if it is a duplicate."""
        newest = self._newest
        if newest < 0:
            self._accept(seq, crc, 256 + seq)
            return True
        ahead = (seq - newest) & 0xFF
        if self._crc[seq] == crc and newest - self._position[seq] < WINDOW:
            return False
        if 0 < ahead < WINDOW:
            self.lost += ahead - 1
            self._leap = max(self._leap, ahead - 1)
            self._accept(seq, crc, newest + ahead)
            return True
        behind = newest - ((newest - seq) & 0xFF)
        if self._position[seq] < behind:
            self.lost = max(0, self.lost - 1)
            self._crc[seq] = crc
            self._position[seq] = behind
            return True
        self.restart(seq, crc)
        return True

    def goes_on(self) -> None:
        """Note that the source has not restarted so far: all steps ahead were losses."""
        self._leap = 0

    def restart(self, seq: int, crc: int) -> None:
        """Start over with a source that counts from a new number, and forget what was heard."""
        self.restarts += 1
        self.lost = max(0, self.lost - self._leap)
        self._leap = 0
        self._crc = [-1] * 256
        self._accept(seq, crc, self._newest + 256 + ((seq - self._newest) & 0xFF))

    def _accept(self, seq: int, crc: int, position: int) -> None:
        self._newest = position
        self._crc[seq] = crc
        self._position[seq] = position
