"""The Pound paper's control loop with and without correction for latency (its future work).

The circuit is that of section VI-G; the controller's input is as old as a link makes it. With
correction, the age tells the controller the plant's present state, and its state when the answer
arrives.
"""

import numpy as np
from numpy.typing import NDArray

from benchmarks.peers.pound.control import GAIN, PERIOD_S, SETPOINT, local_loop, plant

LEAST_S = 0.002


def draw_s(rng: np.random.Generator, mean_s: float, n: int) -> NDArray[np.float64]:
    """Draw one-way latencies: at least 2 ms, the rest exponential."""
    return LEAST_S + rng.exponential(max(mean_s - LEAST_S, 0.0), n)


def run_loop(delays_s: NDArray[np.float64], ticks: int, *, corrected: bool) -> NDArray[np.float64]:
    """Vc(k) in V `[ticks]`; `delays_s` `[ticks, 2]`: there and back."""
    a, b = plant()
    x, vc = np.zeros(2), np.zeros(ticks)
    answers: list[tuple[float, int, float]] = []
    held = 0.0
    sent = np.zeros(ticks)
    for k in range(ticks):
        now = k * PERIOD_S
        arrived = [each for each in answers if each[0] <= now]
        if arrived:
            # Only the newest counts, whatever the order of arrival.
            held = max(arrived, key=lambda each: each[1])[2]
            answers = [each for each in answers if each[0] > now]
        vc[k] = x[0]
        sent[k] = held
        there_s, back_s = delays_s[k]
        y = x.copy()
        if corrected:
            # Number of periods until the answer takes effect.
            ahead = int(np.ceil((there_s + back_s) / PERIOD_S)) - 1
            for i in range(ahead):
                y = a @ y + b * sent[max(0, k - i)]
        answers.append((now + there_s + back_s, k, GAIN * (SETPOINT - y[0])))
        x = a @ x + b * held
    return vc


def rms_mv(seed: int, mean_s: float, seconds: float, runs: int, *, corrected: bool) -> float:
    """RMS difference to the local run, in mV, over all runs."""
    ticks = round(seconds / PERIOD_S)
    rng = np.random.default_rng(seed)
    local, squares = local_loop(ticks), []
    for _ in range(runs):
        delays_s = draw_s(rng, mean_s, 2 * ticks).reshape(ticks, 2)
        squares.append(np.mean((run_loop(delays_s, ticks, corrected=corrected) - local) ** 2))
    return float(1e3 * np.sqrt(np.mean(squares)))
