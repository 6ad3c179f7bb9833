"""The ciphers that follow from a key (wire document, sections 11.1 and 11.2)."""

from cryptography.exceptions import InvalidTag
from cryptography.hazmat.primitives.ciphers.aead import AESCCM
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.kdf.hkdf import HKDF

from sdrlinkd.sealing.keys import Key
from sdrlinkd.wire import BROADCAST, TAG_SIZE, Sealed, build_sealed, seal_number, seal_parts

_SUBKEY_SIZE = 16
_MODES = {"seal": 1, "auth": 2}


class Ciphers:
    """Seals and opens the bodies of PDUs with one key in one mode."""

    def __init__(self, key: Key, mode: str) -> None:
        self.key = key
        self._pairs = key.pairs
        self._ticks, self._number = -1, b""
        self._mode = _MODES[mode]
        self._is_auth = mode == "auth"
        self._by_ends: dict[tuple[int, int], AESCCM] = {}

    def seal(self, inner: bytes, ticks: int) -> bytes:
        """The sealed PDU of an inner PDU, with this T."""
        if ticks != self._ticks:
            # Many PDUs have one T.
            self._ticks, self._number = ticks, seal_number(self.key.kid, ticks)
        head, nonce, associated, text = seal_parts(inner, self._number)
        cipher = self._cipher(inner[1], inner[2])
        if self._is_auth:
            return build_sealed(head, text + cipher.encrypt(nonce, b"", associated + text))
        return build_sealed(head, cipher.encrypt(nonce, text, associated))

    def open(self, pdu: Sealed) -> bytes | None:
        """The plaintext of a PDU; None if it does not open."""
        cipher = self._cipher(pdu.src, pdu.dst)
        nonce, associated, secret = pdu.parts()
        try:
            if self._is_auth:
                body = secret[:-TAG_SIZE]
                cipher.decrypt(nonce, secret[-TAG_SIZE:], associated + body)
                return body
            return cipher.decrypt(nonce, secret, associated)
        except InvalidTag:
            return None

    def _cipher(self, src: int, dst: int) -> AESCCM:
        ends = (src, dst if self._pairs and self._pair(src, dst) else BROADCAST)
        cipher = self._by_ends.get(ends)
        if cipher is None:
            cipher = self._by_ends[ends] = self._derived(*ends)
        return cipher

    def _pair(self, src: int, dst: int) -> bytes | None:
        return self._pairs.get(frozenset((src, dst)))

    def _derived(self, src: int, dst: int) -> AESCCM:
        pair = self._pair(src, dst)
        info = b"sdrlinkd sealed" + bytes((self._mode, self.key.kid, src))
        if pair is not None:
            info += bytes((dst,))
        derive = HKDF(SHA256(), _SUBKEY_SIZE, salt=None, info=info)
        return AESCCM(derive.derive(pair or self.key.secret), tag_length=TAG_SIZE)
