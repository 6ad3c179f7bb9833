"""The ciphers that follow from a key (wire document, sections 11.1 and 11.2)."""

from cryptography.exceptions import InvalidTag
from cryptography.hazmat.primitives.ciphers.aead import AESCCM
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.kdf.hkdf import HKDF

from sdrlinkd.sealing.keys import Key
from sdrlinkd.wire import BROADCAST, TAG_SIZE, Sealed, associated_data, seal_nonce

_SUBKEY_SIZE = 16
_MODES = {"seal": 1, "auth": 2}


class Ciphers:
    """Seals and opens the bodies of PDUs with one key in one mode."""

    def __init__(self, key: Key, mode: str) -> None:
        self.key = key
        self._mode = _MODES[mode]
        self._is_auth = mode == "auth"
        self._by_ends: dict[tuple[int, int], AESCCM] = {}

    def seal(self, header: bytes, ticks: int, plaintext: bytes) -> bytes:
        """Body and tag of a PDU with this header and T."""
        kid = self.key.kid
        cipher = self._cipher(header[1], header[2])
        nonce, associated = seal_nonce(kid, ticks, header[3]), associated_data(header, kid, ticks)
        if self._is_auth:
            return plaintext + cipher.encrypt(nonce, b"", associated + plaintext)
        return cipher.encrypt(nonce, plaintext, associated)

    def open(self, pdu: Sealed) -> bytes | None:
        """The plaintext of a PDU; None if it does not open."""
        cipher = self._cipher(pdu.src, pdu.dst)
        try:
            if self._is_auth:
                cipher.decrypt(pdu.nonce, pdu.tag, pdu.associated + pdu.body)
                return pdu.body
            return cipher.decrypt(pdu.nonce, pdu.body + pdu.tag, pdu.associated)
        except InvalidTag:
            return None

    def _cipher(self, src: int, dst: int) -> AESCCM:
        ends = (src, dst if self._pair(src, dst) else BROADCAST)
        if ends not in self._by_ends:
            self._by_ends[ends] = self._derived(*ends)
        return self._by_ends[ends]

    def _pair(self, src: int, dst: int) -> bytes | None:
        return self.key.pairs.get(frozenset((src, dst))) if self.key.pairs else None

    def _derived(self, src: int, dst: int) -> AESCCM:
        pair = self._pair(src, dst)
        info = b"sdrlinkd sealed" + bytes((self._mode, self.key.kid, src))
        if pair is not None:
            info += bytes((dst,))
        derive = HKDF(SHA256(), _SUBKEY_SIZE, salt=None, info=info)
        return AESCCM(derive.derive(pair or self.key.secret), tag_length=TAG_SIZE)
