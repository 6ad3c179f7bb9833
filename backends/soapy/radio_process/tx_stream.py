"""The transmit stream of a device, for any sample format."""

import numpy as np

from backends.base import Samples
from backends.soapy.binding import ERRORS, DriverError, Stream, Values

_FULL_SCALE = {"CS16": (np.int16, 32767), "CS8": (np.int8, 127)}


class TxStream:
    """A transmit stream that accepts samples of type `form`."""

    def __init__(self, stream: Stream, form: str) -> None:
        self.stream = stream
        self._form = form

    def activate(self) -> None:
        """Switch the transmitter on. Raises DriverError."""
        n = self.stream.activate()
        if n < 0:
            raise DriverError(f"cannot switch the transmitter on ({ERRORS.get(n, n)})")

    def converted(self, samples: Samples) -> Values:
        """Convert samples to the stream's format; values beyond full scale are clipped."""
        if self._form == "CF32":
            return samples
        kind, full = _FULL_SCALE[self._form]
        parts = np.clip(samples.view(np.float32), -1, 1) * np.float32(full)
        whole = np.rint(parts).astype(kind)
        values: Values = whole.view(f"V{2 * whole.itemsize}")
        return values
