"""Sample types of recordings: bytes to complex64 at ±1 full scale, and back."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from backends.base import BackendError, Samples


@dataclass(frozen=True)
class SampleType:
    """A complex sample type by its SigMF name; values are (stored − `offset`) / `full_scale`."""

    name: str
    dtype: np.dtype[np.generic]
    full_scale: float
    offset: float = 0.0

    @property
    def size(self) -> int:
        """Bytes of one complex sample."""
        return 2 * self.dtype.itemsize

    def decode(self, data: bytes | memoryview) -> Samples:
        """Decode the whole samples in `data`, at ±1 full scale."""
        parts = np.frombuffer(data, self.dtype).astype(np.float32)
        if self.offset:
            parts -= np.float32(self.offset)
        if self.full_scale != 1:
            parts *= np.float32(1 / self.full_scale)
        samples: Samples = parts.view(np.complex64)
        return samples

    def encode(self, samples: Samples) -> tuple[bytes, int]:
        """Encode samples; returns (bytes, number of values beyond full scale, which clip)."""
        parts: NDArray[np.float32] = np.ascontiguousarray(samples, np.complex64).view(np.float32)
        if self.dtype.kind == "f":
            return parts.astype(self.dtype).tobytes(), 0
        if not np.isfinite(parts).all():
            parts = np.nan_to_num(parts)
        with np.errstate(over="ignore"):
            scaled = np.rint(parts * np.float32(self.full_scale) + np.float32(self.offset))
        low = -self.full_scale + self.offset
        clipped = np.clip(scaled, np.ceil(low), low + 2 * self.full_scale - 1)
        return clipped.astype(self.dtype).tobytes(), int(np.count_nonzero(clipped != scaled))


SAMPLE_TYPES = {
    each.name: each
    for each in (
        SampleType("cf32_le", np.dtype("<f4"), 1.0),
        SampleType("ci16_le", np.dtype("<i2"), 32768.0),
        SampleType("ci8", np.dtype("i1"), 128.0),
        SampleType("cu8", np.dtype("u1"), 128.0, 127.5),
    )
}
"""The sample types by SigMF name; cu8 is what rtl_sdr writes."""


def sample_type(name: str, where: str) -> SampleType:
    """The type called `name`. Raises BackendError that cites `where`."""
    known = SAMPLE_TYPES.get(name)
    if known is None:
        raise BackendError(
            f'{where}: sample type: got "{name.encode("ascii", "backslashreplace").decode()}"; '
            f"allowed: {', '.join(SAMPLE_TYPES)}"
        )
    return known
