"""The receiver's states: every transition is allowed or refused, and each allowed one occurs."""

import itertools

import numpy as np
import pytest

from phy import Receiver
from phy.testing import states
from tests.phy.chunks import make_stream
from tests.phy.signals import noise

PIECE = 700
State, Found, NEXT = states.State, states.Found, states.NEXT


@pytest.mark.parametrize(("state", "found"), [*itertools.product(State, Found)])
def test_every_step_is_allowed_or_refused(state, found):
    if (state, found) in NEXT:
        assert states.after(state, found) is NEXT[state, found]
        return
    with pytest.raises(states.IllegalStepError, match=f"{found.name} in {state.name}"):
        states.after(state, found)


def test_every_state_can_be_reached_and_left():
    reached = {State.SEARCH}
    for _ in State:
        reached |= {following for (state, _), following in NEXT.items() if state in reached}
    assert reached == {*State}
    assert all((state, Found.CUT) in NEXT for state in State)


def test_signals_take_every_allowed_step(monkeypatch):
    """Bursts, foreign ones, tones, invalid headers, fades, and gaps at any time."""
    taken = set()

    class Spied(dict):
        def get(self, step):
            taken.add(step)
            return super().get(step)

    monkeypatch.setattr(states, "NEXT", Spied(NEXT))
    for seed in range(30):
        rng = np.random.default_rng(seed)
        x = make_stream(seed)[0]
        tone = np.exp(2j * np.pi * 0.003 * np.arange(4000)) + noise(rng, 4000, 0.01)
        x = np.concatenate((x, tone.astype(np.complex64), x))
        receiver = Receiver(max_frequency=0.03)
        for at in range(0, len(x), PIECE):
            receiver.push(x[at : at + PIECE])
            if rng.random() < 0.2:
                receiver.gap(int(rng.integers(0, 300)))
        receiver.flush()
    # A gap first processes the samples before it, so only a burst can be cut.
    rare = {(State.ALIGN, Found.CUT), (State.ACQUIRE, Found.CUT)}
    assert set(NEXT) - rare <= taken <= set(NEXT)
