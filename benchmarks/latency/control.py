"""A control loop whose controller knows how old its input is, and one that does not.

The circuit is that of section VI-G of the Pound paper. Every 20 ms the plant sends its state. The
controller answers at once, and the plant holds the last answer that has arrived. Pushes that the
controller does not know keep the circuit moving.
"""

from bisect import bisect_right
from collections import deque
from dataclasses import dataclass, field
from math import isnan, nan
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.peers.pound.control import GAIN, SETPOINT
from benchmarks.peers.pound.control import plant as step_matrices

State = NDArray[np.float64]
"""(Vc, Vc')."""
Knows = Literal["age", "mean", "nothing"]
"""By what the controller extrapolates: each input's own age, the mean of ages, or not at all."""

PERIOD_S = 0.02
STEP_S = 1e-3
PUSH_V, PUSH_S = 0.5, 0.3
"""Largest push, and how long each lasts."""
WEIGHT = 0.1
"""Of a new age in a running mean."""
ANSWERS = 64
"""Answers that the controller remembers."""


A, B = step_matrices(STEP_S)


def pushes(rng: np.random.Generator, seconds: float) -> State:
    """Voltages that are added to the input at each step; none of the controllers knows them."""
    n = int(np.ceil(seconds / PUSH_S))
    each = rng.uniform(-PUSH_V, PUSH_V, n)
    return np.repeat(each, round(PUSH_S / STEP_S))[: round(seconds / STEP_S)]


class Plant:
    """The circuit in steps of 1 ms; `vc` has Vc after each of them."""

    def __init__(self, pushed: State) -> None:
        self.x = np.zeros(2)
        self.held = 0.0
        """The input that is applied now."""
        self.vc: list[float] = []
        self._pushed = pushed

    def advance(self, until_s: float) -> None:
        """Let the time pass with the same input."""
        last = min(round(until_s / STEP_S), len(self._pushed))
        for k in range(len(self.vc), last):
            self.x = A @ self.x + B * (self.held + self._pushed[k])
            self.vc.append(float(self.x[0]))


class Held(NamedTuple):
    """What the plant reports of its input; the ages are NaN before the first answer."""

    voltage: float
    arrived_s: float
    """How old the answer was at its arrival."""
    age_s: float
    """The mean age of what was held since the last report."""


class Holding:
    """The answer that the plant holds; all times are those of its own clock, in s."""

    def __init__(self) -> None:
        self.voltage = 0.0
        self._arrived_s = self._origin_at = self._at = nan
        self._sum = self._span_s = 0.0

    def take(self, voltage: float, origin_at: float, now: float) -> None:
        """Hold an answer that was sent at `origin_at`."""
        self._count(now)
        self.voltage, self._origin_at, self._at = voltage, origin_at, now
        self._arrived_s = now - origin_at

    def report(self, now: float) -> Held:
        """Return what is held, with the mean age since the last report."""
        self._count(now)
        age_s = self._sum / self._span_s if self._span_s else self._arrived_s
        self._sum = self._span_s = 0.0
        return Held(self.voltage, self._arrived_s, age_s)

    def _count(self, now: float) -> None:
        if not isnan(self._at) and now > self._at:
            span_s = now - self._at
            self._sum += span_s * ((now + self._at) / 2 - self._origin_at)
            self._span_s += span_s
            self._at = now


@dataclass
class Controller:
    """Computes answers; all times are those of its own clock, in s."""

    knows: Knows
    answer_s: float | None = None
    """The mean age of answers when they come to the plant, as far as it has reported them."""
    held_s: float | None = None
    """The mean age of the answer that the plant holds."""
    input_s: float | None = None
    """The mean age of inputs."""
    _answers: deque[tuple[float, float]] = field(default_factory=lambda: deque(maxlen=ANSWERS))
    """When each answer was sent, and its voltage."""

    def answer(self, x: State, held: Held, age_s: float, now: float) -> float:
        """Return the voltage for a state that was measured `age_s` ago, when `held` was applied."""
        self.input_s = _mean(self.input_s, age_s)
        if not isnan(held.arrived_s):
            self.answer_s = _mean(self.answer_s, held.arrived_s)
            self.held_s = _mean(self.held_s, held.age_s)
        if self.knows != "nothing":
            ago_s = age_s if self.knows == "age" else self.input_s
            # Until the plant has reported anything, both ways are assumed to be alike.
            answer_s = self.answer_s or self.input_s
            # An answer aims at the middle of the time for which it is held.
            later_s = max(0.0, (self.held_s or 0.0) - answer_s - PERIOD_S / 2)
            x = self._ahead(x, held.voltage, now - ago_s, now + answer_s + later_s, answer_s)
        voltage = GAIN * (SETPOINT - float(x[0]))
        self._answers.append((now, voltage))
        return voltage

    def _ahead(self, x: State, held: float, since: float, until: float, answer_s: float) -> State:
        """The state at `until`, with the answers that take effect by then."""
        at = [sent_at + answer_s for sent_at, _ in self._answers]
        for step in range(round((until - since) / STEP_S)):
            arrived = bisect_right(at, since + step * STEP_S) - 1
            is_known = arrived >= 0 and at[arrived] > since
            x = A @ x + B * (self._answers[arrived][1] if is_known else held)
        return x


def _mean(before: float | None, new: float) -> float:
    return new if before is None else before + WEIGHT * (new - before)


def at_the_plant(pushed: State) -> State:
    """Vc after each step in V, with a controller at the plant that answers without any delay."""
    plant = Plant(pushed)
    for k in range(0, len(pushed), round(PERIOD_S / STEP_S)):
        plant.advance(k * STEP_S)
        plant.held = GAIN * (SETPOINT - float(plant.x[0]))
    plant.advance(len(pushed) * STEP_S)
    return np.array(plant.vc)
