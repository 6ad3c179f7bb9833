"""The receiver's states, and the transitions between them.

A burst begins with a preamble that repeats a segment under a code of signs. SEARCH slides the
normalised autocorrelation of segments over the stream. It costs a few operations per sample, does
not depend on the frequency offset, and crosses its threshold somewhere within the preamble. ALIGN
finds the maximum within a preamble's length of that crossing, because only there all segments
contribute. It rejects a tone or another network's signal, whose peak does not need the code.
ACQUIRE correlates with the long training at all possible offsets, which yields start and frequency.
It estimates the channel and reads the header: only a header with a valid check makes a peak a
burst. PAYLOAD demodulates symbol by symbol until the last PDU, or until the burst's power has
vanished. After any failure, the search continues right after the peak, not after the end that the
header announced: a false header must not make the receiver deaf.

::

              CROSSING          PEAK            HEADER
    SEARCH ────────────▶ ALIGN ───────▶ ACQUIRE ───────▶ PAYLOAD ─┐ PDUS
       ▲                   │ NOTHING       │ NOTHING       │  ▲    │
       │                   │               │ BAD_HEADER    │  └────┘
       │                   │               │ FOREIGN       │ OVER
       └───────────────────┴───────────────┴───────────────┘
            CUT, from anywhere: samples are missing, or the stream has ended
"""

from collections.abc import Mapping
from enum import Enum, auto


class State(Enum):
    """The state of the receiver, which is what it waits for."""

    SEARCH = auto()
    """The metric crosses its threshold."""
    ALIGN = auto()
    """The preamble's length after the crossing has arrived."""
    ACQUIRE = auto()
    """Training and header after the peak have arrived."""
    PAYLOAD = auto()
    """The symbols that complete the next PDUs have arrived."""

    # That of Enum runs in the interpreter, and every burst takes a dozen.
    __hash__ = object.__hash__


class Found(Enum):
    """The receiver's finding in the samples that it waited for."""

    CROSSING = auto()
    PEAK = auto()
    NOTHING = auto()
    """The peak does not belong to a preamble."""
    BAD_HEADER = auto()
    """There is a preamble, but its header fails its check, or tells what this link never sends."""
    FOREIGN = auto()
    """The header names another network."""
    HEADER = auto()
    PDUS = auto()
    """Some of the burst's PDUs are complete, and more follow."""
    OVER = auto()
    """The burst has ended, whole or faded."""
    CUT = auto()
    """Samples are missing here, or the stream ends."""

    __hash__ = object.__hash__


NEXT: Mapping[tuple[State, Found], State] = {
    (State.SEARCH, Found.CROSSING): State.ALIGN,
    (State.ALIGN, Found.PEAK): State.ACQUIRE,
    (State.ALIGN, Found.NOTHING): State.SEARCH,
    (State.ACQUIRE, Found.NOTHING): State.SEARCH,
    (State.ACQUIRE, Found.BAD_HEADER): State.SEARCH,
    (State.ACQUIRE, Found.FOREIGN): State.SEARCH,
    (State.ACQUIRE, Found.HEADER): State.PAYLOAD,
    (State.PAYLOAD, Found.PDUS): State.PAYLOAD,
    (State.PAYLOAD, Found.OVER): State.SEARCH,
    **{(state, Found.CUT): State.SEARCH for state in State},
}


class IllegalStepError(Exception):
    """A transition that NEXT does not contain: a bug of ours, which ends the daemon."""


def after(state: State, found: Found) -> State:
    """The state that follows `state` on `found`. Raises IllegalStepError if there is none."""
    following = NEXT.get((state, found))
    if following is None:
        raise IllegalStepError(f"{found.name} in {state.name}")
    return following
