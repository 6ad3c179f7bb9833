"""The ciphers that follow from a key (wire document, sections 11.1 and 11.2)."""

from cryptography.exceptions import InvalidTag
from cryptography.hazmat.primitives.ciphers.aead import AESCCM
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.kdf.hkdf import HKDF

from sdrlinkd.sealing.keys import Key
from sdrlinkd.wire import BROADCAST, DST, SRC, TAG_SIZE, Sealed, build_sealed

_SUBKEY_SIZE = 16
_MODES = {"seal": 1, "auth": 2}


class _Readable:
    """AES-CCM that proves who wrote a text, and leaves it as it is."""

    def __init__(self, cipher: AESCCM) -> None:
        self._cipher = cipher

    def encrypt(self, nonce: bytes, text: bytes, associated: bytes) -> bytes:
        return text + self._cipher.encrypt(nonce, b"", associated + text)

    def decrypt(self, nonce: bytes, secret: bytes, associated: bytes) -> bytes:
        text = secret[:-TAG_SIZE]
        self._cipher.decrypt(nonce, secret[-TAG_SIZE:], associated + text)
        return text


class Ciphers:
    """Seals and opens the bodies of PDUs with one key in one mode."""

    def __init__(self, key: Key, mode: str) -> None:
        self.key = key
        self._pairs = key.pairs
        self._kid = key.kid
        self._mode = _MODES[mode]
        self._is_auth = mode == "auth"
        self._by_src: dict[int, AESCCM | _Readable] = {}
        """Those of the sources that have the same one towards all others."""
        self._by_ends: dict[tuple[int, int], AESCCM | _Readable] = {}

    def seal(self, inner: bytes, ticks: int) -> bytes:
        """The sealed PDU of an inner PDU, with this T."""
        cipher = self._by_src.get(inner[SRC]) or self._cipher(inner[SRC], inner[DST])
        return build_sealed(inner, self._kid, ticks, cipher.encrypt)

    def open(self, pdu: Sealed) -> bytes | None:
        """The inner PDU of a sealed one; None if it does not open."""
        cipher = self._by_src.get(pdu.src) or self._cipher(pdu.src, pdu.dst)
        try:
            return pdu.inner(cipher.decrypt)
        except InvalidTag:
            return None

    def _cipher(self, src: int, dst: int) -> AESCCM | _Readable:
        ends = (src, dst if self._pair(src, dst) else BROADCAST)
        cipher = self._by_ends.get(ends)
        if cipher is None:
            cipher = self._by_ends[ends] = self._derived(*ends)
            if not any(src in pair for pair in self._pairs):
                self._by_src[src] = cipher
        return cipher

    def _pair(self, src: int, dst: int) -> bytes | None:
        return self._pairs.get(frozenset((src, dst)))

    def _derived(self, src: int, dst: int) -> AESCCM | _Readable:
        pair = self._pair(src, dst)
        info = b"sdrlinkd sealed" + bytes((self._mode, self.key.kid, src))
        if pair is not None:
            info += bytes((dst,))
        derive = HKDF(SHA256(), _SUBKEY_SIZE, salt=None, info=info)
        cipher = AESCCM(derive.derive(pair or self.key.secret), tag_length=TAG_SIZE)
        return _Readable(cipher) if self._is_auth else cipher
