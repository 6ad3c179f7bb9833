"""The receiver's states, and what leads from one to the next.

A burst begins with a preamble that repeats a segment under a code of signs. SEARCH slides the
normalised autocorrelation of segments over the stream: it costs a few operations a sample, knows
no frequency offset, and crosses its threshold somewhere within the preamble. ALIGN looks for the
maximum within a preamble's length of that crossing, because only there all segments take part, and
tells a tone or another network's signal by a peak that needs no code. ACQUIRE correlates with the
long training at all offsets that may be, which tells start and frequency, estimates the channel,
and reads the header: only its check makes a burst of a peak. PAYLOAD demodulates symbol by symbol
until the last PDU, or until the burst's power is gone. Whatever fails, the search goes on right
behind the peak, not behind what the header promised: a header that lies must not make us deaf.

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
    """What the receiver waits for."""

    SEARCH = auto()
    """The metric crosses its threshold."""
    ALIGN = auto()
    """The preamble's length behind the crossing is there."""
    ACQUIRE = auto()
    """Training and header behind the peak are there."""
    PAYLOAD = auto()
    """The symbols that complete the next PDUs are there."""


class Found(Enum):
    """What the receiver makes of the samples that it waited for."""

    CROSSING = auto()
    PEAK = auto()
    NOTHING = auto()
    """The peak is no preamble's."""
    BAD_HEADER = auto()
    """There is a preamble, and its header fails its check."""
    FOREIGN = auto()
    """The header names another network."""
    HEADER = auto()
    PDUS = auto()
    """Some of the burst's PDUs are through, and more are to come."""
    OVER = auto()
    """The burst has ended, whole or faded."""
    CUT = auto()
    """Samples are missing here, or none follow."""


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
    """A step that NEXT does not have: a bug of ours, which ends the daemon."""


def after(state: State, found: Found) -> State:
    """The state that follows `state` on `found`. Raises IllegalStepError where there is none."""
    following = NEXT.get((state, found))
    if following is None:
        raise IllegalStepError(f"{found.name} in {state.name}")
    return following
