"""GNU Radio: runs `gnu_radio_ofdm.py` in this folder with the system's interpreter."""

from pathlib import Path

from benchmarks.absent import PeerError
from benchmarks.processes import told_by

PYTHON = "/usr/bin/python3"
SCRIPT = Path(__file__).with_name("gnu_radio_ofdm.py")


class GnuRadio:
    """GNU Radio's OFDM modem, which has no error correction; `bits` per subcarrier, 1 or 2.

    Every measurement raises PeerError and ProcessError if GNU Radio is absent (Debian: gnuradio).
    """

    name = "GNU Radio"

    def errors(self, bits: int, n_bytes: int, snr_db: float, n: int, seed: int) -> int:
        """Number of `n` frames that are lost."""
        return int(self._run("errors", bits, n_bytes, snr_db, n, seed))

    def speed(self, bits: int, n_bytes: int, n: int, seed: int) -> tuple[float, float]:
        """Msps of CPU time: (transmitter, receiver at 30 dB with gaps of 400 samples)."""
        sends, hears = self._run("speed", bits, n_bytes, n, seed).split()
        return float(sends), float(hears)

    def noise_msps(self, n_samples: int, seed: int) -> float:
        """Msps of CPU time of a receiver on noise alone."""
        return float(self._run("noise", n_samples, seed))

    def _run(self, *arguments: object) -> str:
        lines = told_by(self.name, PYTHON, SCRIPT, *arguments).strip().splitlines()
        if not lines:
            raise PeerError(f"{self.name}: it printed nothing")
        return lines[-1]
