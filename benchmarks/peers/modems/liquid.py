"""liquid-dsp: builds `liquid.c` in this folder if the library and a compiler are installed."""

import functools
import shutil
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.absent import PeerError
from benchmarks.processes import told_by

SOURCE = Path(__file__).with_name("liquid.c")


class Liquid:
    """liquid-dsp's modem; codes have liquid-dsp's names: "none", "h128", "g2412".

    Every measurement raises PeerError and ProcessError if it is absent (Debian: libliquid-dev).
    """

    name = "liquid-dsp"

    def errors(self, code: str, bits: int, n_bytes: int, snr_db: float, n: int, seed: int) -> int:
        """Number of `n` frames that are lost."""
        return int(self._run("errors", code, bits, n_bytes, snr_db, n, seed))

    def headers(self, snr_db: float, n: int, seed: int) -> int:
        """Number of headers of `n` frames that are read."""
        return int(self._run("headers", snr_db, n, seed))

    def speed(self, code: str, bits: int, n_bytes: int) -> tuple[float, float]:
        """Msps of CPU time: (transmitter, receiver at 30 dB with gaps of 400 samples)."""
        sends, hears = self._run("speed", code, bits, n_bytes).split()
        return float(sends), float(hears)

    def noise_msps(self, n_samples: int, seed: int) -> float:
        """Msps of CPU time of a receiver on noise alone."""
        return float(self._run("noise", n_samples, seed).split()[0])

    def frame(self, code: str, bits: int, n_bytes: int, seed: int) -> NDArray[np.complex64]:
        """The samples of a frame `[n]`; its payload is drawn from `seed`."""
        file = self._program.with_name("frame")
        self._run("send", code, bits, n_bytes, seed, file)
        return np.fromfile(file, np.complex64)

    def heard(self, n_bytes: int, seed: int, samples: NDArray[np.complex64]) -> int:
        """How many frames with that payload are read in samples `[n]`."""
        file = self._program.with_name("samples")
        samples.tofile(file)
        return int(self._run("hear", n_bytes, seed, file))

    def _run(self, *arguments: object) -> str:
        return told_by(self.name, self._program, *arguments)

    @functools.cached_property
    def _program(self) -> Path:
        compiler = shutil.which("gcc") or shutil.which("cc")
        if compiler is None:
            raise PeerError(f"{self.name}: no C compiler (Debian: gcc)")
        program = Path(tempfile.mkdtemp(prefix="sdrlink-bench-")) / "liquid"
        flags = ["-O3", "-march=native", "-std=gnu11"]
        told_by(self.name, compiler, *flags, SOURCE, "-o", program, "-lliquid", "-lm")
        return program
