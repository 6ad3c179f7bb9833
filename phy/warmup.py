"""Compiles every kernel that a link runs, or loads it from the cache, before it is needed."""

import sys
from collections.abc import Callable
from contextlib import ExitStack
from typing import Any

import numpy as np
from numba.core.caching import NullCache
from numba.core.dispatcher import Dispatcher
from numba.core.event import Event, Listener, install_listener
from numpy.typing import NDArray

from phy import header, preamble
from phy.channel import FrontEnd, FrontEndParams, Path, PathParams
from phy.mcs import MCS_TABLE
from phy.numerology import OFDM_64_16
from phy.oversampling import Downsampler, upsample
from phy.receiver import Receiver
from phy.sensing import EnergyDetector
from phy.transmitter import Transmitter

Progress = Callable[[int, int], None]

RATE_HZ, CENTRE_HZ, CLOCK_PPM = 1e6, 1e8, 40.0
"""A realistic clock error: 0.004 cycles per sample, which a receiver expects."""
LONG = 2000
"""Bytes of a PDU long enough for two clocks to drift apart by a sample."""
# Kernels that only 802.11a and measurements use.
_ELSEWHERE = {"demodulator.learn_channel", "ldpc_encoder.encode_blocks", "viterbi._decode"}


def warm_up(progress: Progress | None = None) -> None:
    """Run every kernel that a link uses; takes minutes on a fresh machine, later under a second.

    `progress(done, total)` is called for each kernel that has been compiled, and not for those
    loaded from the cache. An exception from it ends the warm-up; kernels compiled so far stay
    compiled.
    """
    with ExitStack() as stack:
        if progress is not None:
            stack.enter_context(install_listener("numba:compile", _Compiled(progress)))
        _run()


class _Compiled(Listener):
    """Counts the kernels that are ready to run, whether compiled or loaded."""

    def __init__(self, progress: Progress) -> None:
        self._progress = progress
        self._kernels = _kernels()

    def on_start(self, event: Event) -> None:
        """Ignore the start of a compilation: only its end is reported."""

    def on_end(self, event: Event) -> None:
        """Report how many kernels are ready, when a kernel or a step of one is compiled."""
        compiled = event.data["dispatcher"]
        if compiled in self._kernels:
            done = sum(kernel is compiled or bool(kernel.overloads) for kernel in self._kernels)
            self._progress(done, len(self._kernels))


def _kernels() -> set[Any]:
    """The kernels that a link runs; uncached steps are compiled with each of them."""
    modules = [module for name, module in sys.modules.items() if name.startswith("phy.kernels.")]
    found: dict[str, Any] = {
        f"{each.py_func.__module__.removeprefix('phy.kernels.')}.{name}": each
        for module in modules
        for name, each in vars(module).items()
        if isinstance(each, Dispatcher)
    }
    # numba reports cached kernels in no other way.
    return {
        each
        for name, each in found.items()
        if name not in _ELSEWHERE and not isinstance(each._cache, NullCache)  # noqa: SLF001
    }


def _run() -> None:
    rng = np.random.default_rng(0)
    transmitter, receiver, sense = Transmitter(), Receiver(), EnergyDetector()
    path = Path(PathParams(rate_hz=RATE_HZ, centre_hz=CENTRE_HZ, clock_ppm=CLOCK_PPM), rng)
    front_end = FrontEnd(FrontEndParams(noise_dbfs=-30.0), rng)

    def hear(burst: NDArray[np.complex64]) -> None:
        samples = front_end.receive(path.carry(burst)[1])
        receiver.push(samples)
        sense.push(samples)
        receiver.flush()

    for mcs in MCS_TABLE:
        hear(transmitter.modulate([bytes(32)], mcs.index))
    hear(transmitter.modulate([bytes(LONG)], 0))
    burst = transmitter.modulate([bytes(32)], 0)
    hear(_with_bad_header(burst, rng))
    Downsampler(2).push(upsample(burst, 2))


def _with_bad_header(
    burst: NDArray[np.complex64], rng: np.random.Generator
) -> NDArray[np.complex64]:
    """The burst with a header whose check fails, so that the receiver tries other headers."""
    n = header.n_symbols(OFDM_64_16) * OFDM_64_16.n_symbol
    bad = burst.copy()
    bad[preamble.length() :][:n] = rng.permutation(burst[preamble.length() :][:n])
    return bad
