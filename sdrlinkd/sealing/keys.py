"""Keys: what a team shares (wire document, section 11.2)."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field

KEY_SIZE = 32
FINGERPRINT_SIZE = 11
"""Octets of a fingerprint that people compare: eight words of eleven bits."""


@dataclass(frozen=True)
class Key:
    """A key of the team: 32 octets under a `kid`; `pairs` holds those of two robots alone."""

    kid: int
    secret: bytes
    pairs: Mapping[frozenset[int], bytes] = field(default_factory=dict, hash=False)
    made_s: float | None = field(default=None, compare=False)
    """When it was made, in s since 1970 by a clock that was synchronized; None: not known."""
    follows: bool = field(default=False, compare=False)
    """Whether it is the next key of another one, whose numbers may have gone on under it."""

    @property
    def fingerprint(self) -> bytes:
        """What people compare, and the air may hear: 11 octets."""
        said = hashlib.sha256(b"sdrlinkd key fingerprint" + self.secret)
        return said.digest()[:FINGERPRINT_SIZE]
