"""GNU Radio: `gnu_radio_ofdm.py` beside this file, run by the system's interpreter."""

import functools
import subprocess
from pathlib import Path

PYTHON = "/usr/bin/python3"
SCRIPT = Path(__file__).with_name("gnu_radio_ofdm.py")


class GnuRadio:
    """Its OFDM modem has no error correction; `bits` a carrier, 1 or 2."""

    name = "GNU Radio"

    @functools.cached_property
    def is_there(self) -> bool:
        """Whether it can be measured."""
        try:
            asked = [PYTHON, "-c", "import gnuradio.digital"]
            return subprocess.run(asked, check=False, capture_output=True).returncode == 0
        except OSError:
            return False

    def errors(self, bits: int, n_bytes: int, snr_db: float, n: int, seed: int) -> int:
        """Of `n` frames, how many are not heard."""
        return int(self._run("errors", bits, n_bytes, snr_db, n, seed))

    def speed(self, bits: int, n_bytes: int, n: int, seed: int) -> tuple[float, float]:
        """Msps of CPU time, (transmitter, receiver at 30 dB with gaps of 400 samples)."""
        sends, hears = self._run("speed", bits, n_bytes, n, seed).split()
        return float(sends), float(hears)

    def noise_msps(self, n_samples: int, seed: int) -> float:
        """Msps of CPU time of a receiver that hears nothing."""
        return float(self._run("noise", n_samples, seed))

    def _run(self, *arguments: object) -> str:
        command = [PYTHON, str(SCRIPT), *map(str, arguments)]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
        return done.stdout.strip().splitlines()[-1]
