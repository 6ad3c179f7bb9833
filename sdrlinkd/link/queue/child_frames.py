"""The key of a message whose producer gives none: its child frames, if its policy says so."""

import hashlib
import struct

from sdrlinkd.link.queue.policy import TopicPolicy

MOST_TRANSFORMS = 1000
MAX_KEY_BYTES = 32
ENCAPSULATION = 4
"""Octets before the message proper; alignment counts from their end."""
_POSE = 7 * 8
"""Octets of the translation and the rotation."""


def key_of(payload: bytes, policy: TopicPolicy) -> str:
    """The key of a message without one; empty if it has the same as all others of its topic."""
    frames = child_frames(payload) if policy.key == "child_frames" else None
    if not frames:
        return ""
    text = ",".join(frames)
    if len(text.encode()) <= MAX_KEY_BYTES:
        return text
    return hashlib.blake2b(text.encode(), digest_size=MAX_KEY_BYTES // 2).hexdigest()


def child_frames(cdr: bytes) -> list[str] | None:
    """The child frames in a tf2_msgs/TFMessage as CDR, sorted; None if the octets are none."""
    order = "<" if cdr[1:2] == b"\x01" else ">"
    frames, at = set(), ENCAPSULATION
    try:
        (n,) = struct.unpack_from(f"{order}I", cdr, at)
        at += 4
        if n > MOST_TRANSFORMS:
            return None
        for _ in range(n):
            at = _aligned(at, 4) + 8
            _, at = _text(cdr, at, order)
            child, at = _text(cdr, at, order)
            frames.add(child)
            at = _aligned(at, 8) + _POSE
    except (struct.error, UnicodeDecodeError):
        return None
    return sorted(frames) if len(cdr) >= at else None


def _aligned(at: int, to: int) -> int:
    return at + (ENCAPSULATION - at) % to


def _text(cdr: bytes, at: int, order: str) -> tuple[str, int]:
    at = _aligned(at, 4)
    (length,) = struct.unpack_from(f"{order}I", cdr, at)
    at += 4
    if at + length > len(cdr):
        raise struct.error("cut short")
    return cdr[at : at + length].rstrip(b"\0").decode(), at + length
