"""Which PDUs of a source were heard, which twice, and how many are missing."""

WINDOW = 128


class SequenceTrack:
    """One source's sequence numbers: duplicates within the last 128 PDUs, and known losses.

    A PDU is the same one when sequence number and CRC (hop nibble taken as zero) are the same.
    Sequence numbers are modulo 256, so a step of up to 127 ahead is that many PDUs, less one,
    lost; an older number is a late arrival when it was missing, and otherwise the sender began
    anew or was away for longer than the numbers can tell.
    """

    __slots__ = ("_crc", "_newest", "_position", "lost", "restarts")

    def __init__(self) -> None:
        self._newest = -1
        # By sequence number: the CRC heard, and at which extended position.
        self._crc = [-1] * 256
        self._position = [-(WINDOW + 1)] * 256
        self.lost = 0
        self.restarts = 0

    def heard(self, seq: int, crc: int) -> bool:
        """Take note of a PDU; False when it is a duplicate."""
        newest = self._newest
        if newest < 0:
            self._accept(seq, crc, 256 + seq)
            return True
        ahead = (seq - newest) & 0xFF
        if self._crc[seq] == crc and newest - self._position[seq] < WINDOW:
            return False
        if 0 < ahead < WINDOW:
            self.lost += ahead - 1
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

    def restart(self, seq: int, crc: int) -> None:
        """The source counts from anew; what was heard before says nothing about what comes."""
        self.restarts += 1
        self._crc = [-1] * 256
        self._accept(seq, crc, self._newest + 256 + ((seq - self._newest) & 0xFF))

    def _accept(self, seq: int, crc: int, position: int) -> None:
        self._newest = position
        self._crc[seq] = crc
        self._position[seq] = position
