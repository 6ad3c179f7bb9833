"""Fingerprints as words, which people compare by voice."""

from functools import cache

from mnemonic import Mnemonic

BITS = 11


@cache
def _list() -> list[str]:
    return list(Mnemonic("english").wordlist)


def words_of(fingerprint: bytes) -> str:
    """Eight words for a fingerprint of 11 octets, from the English list of BIP-39.

    The first octets of one give its first words.
    """
    n = 8 * len(fingerprint) // BITS
    number, mask = (
        int.from_bytes(fingerprint, "big") >> 8 * len(fingerprint) % BITS,
        (1 << BITS) - 1,
    )
    return " ".join(_list()[number >> BITS * (n - 1 - i) & mask] for i in range(n))
