"""The control loop of section VI-G: an RLC circuit at A, its controller at B, one channel between.

    G(s) = 1 / (L C s² + R C s + 1),  L = C = 0.1, R = 1,  u = K (Vi - y),  K = 1, Vi = 1 V, 20 ms

Every 20 ms A samples and sends y, and B answers each y at once. A holds the last u received, from
the next millisecond on: an answer that takes longer changes the voltage. In addition to y, A sends
64 KB every 200 ms, as in the paper, where y competes with this flow at its sender. Both directions
share the channel.
"""

import contextlib

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from benchmarks.peers.pound.ends import Plan, run_ends
from benchmarks.peers.pound.job import Loop, Topic
from benchmarks.peers.pound.namespaces import Network, network

Voltages = NDArray[np.float64]

INDUCTANCE = CAPACITANCE = 0.1
RESISTANCE = 1.0
GAIN = SETPOINT = 1.0
PERIOD_S = 0.02
TICK_S = 0.001
"""Time between two steps of the circuit."""
EVERY = round(PERIOD_S / TICK_S)
"""Number of steps from one sample to the next."""
SMALL = 60
"""Size of a y or a u in bytes."""
LARGE = 65536
LARGE_PERIOD_S = 0.2


def plant(step_s: float = PERIOD_S) -> tuple[Voltages, Voltages]:
    """A `[2, 2]` and b `[2]` of x(k+1) = A x(k) + b u(k), u held for a step; x = (Vc, Vc')."""
    lc = INDUCTANCE * CAPACITANCE
    # exp of [[F, g], [0, 0]] T contains exp(F T) and the integral of exp(F t) g.
    whole = np.zeros((3, 3))
    whole[0, 1] = 1.0
    whole[1] = [-1 / lc, -RESISTANCE * CAPACITANCE / lc, 1 / lc]
    whole = expm(whole * step_s)
    return whole[:2, :2], whole[:2, 2]


def local_loop(ticks: int) -> Voltages:
    """Vc(k) in V, `[ticks]`, with u(k) computed from y(k-1): the optimum over any network."""
    a, b = plant()
    x, u, vc = np.zeros(2), 0.0, np.zeros(ticks)
    for k in range(ticks):
        vc[k] = x[0]
        x = a @ x + b * u
        u = GAIN * (SETPOINT - vc[k])
    return vc


def undelayed(ticks: int, delay: int = 0) -> Voltages:
    """Vc(k) in V at each step, `[ticks]`: the local run, where each u takes effect at once.

    With a `delay`, each takes effect so many steps after its sample.
    """
    a, b = plant(TICK_S)
    x, u, vc = np.zeros(2), np.zeros(ticks + delay + EVERY), np.zeros(ticks)
    for k in range(ticks):
        vc[k] = x[0]
        if k % EVERY == 0:
            u[k + delay : k + delay + EVERY] = GAIN * (SETPOINT - vc[k])
        x = a @ x + b * u[k]
    return vc


def rms_mv(voltages: Voltages) -> float:
    """RMS difference to the local run, in mV."""
    error = voltages - undelayed(len(voltages))
    return float(1e3 * np.sqrt(np.mean(error**2)))


def control_loop(
    peer: str,
    phase_s: float,
    seconds: float = 3.0,
    perturbation: bool = True,
    over: Network | None = None,
) -> Voltages:
    """Vc(k) in V at each step, through `peer` over `over` (else a shared channel of its own).

    The first large message leaves `phase_s` after the first sample.
    """
    ticks = round(seconds / TICK_S)
    a, b = plant(TICK_S)
    topics = [
        Topic(0, "y", SMALL, "latency", "a"),
        Topic(1, "u", SMALL, "latency", "b"),
        Topic(2, "perturbation", LARGE, "bulk", "a"),
    ]
    loads = np.arange(phase_s, seconds if perturbation else phase_s, LARGE_PERIOD_S)
    sends = {"a": [(float(at), 2, n) for n, at in enumerate(loads)]}
    loop = Loop(TICK_S, ticks, EVERY, a.tolist(), b.tolist(), GAIN, SETPOINT)
    with contextlib.ExitStack() as stack:
        channel = over or stack.enter_context(network(shared=True))
        told = run_ends(peer, Plan(topics, sends, seconds + 0.1, loop), channel)
    return np.array(told["a"].values)
