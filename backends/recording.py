"""Recordings of samples: a data file and what SigMF's metadata says of it (sigmf.org)."""

import datetime
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from backends.base import BackendError, Samples
from backends.samples import SampleType, sample_type

META_SUFFIX, DATA_SUFFIX = ".sigmf-meta", ".sigmf-data"
RAW_TYPES = {
    ".cf32": "cf32_le", ".fc32": "cf32_le", ".cfile": "cf32_le", ".c32": "cf32_le",
    ".ci16": "ci16_le", ".sc16": "ci16_le", ".i16": "ci16_le",
    ".ci8": "ci8", ".cs8": "ci8", ".sc8": "ci8", ".cu8": "cu8", ".u8": "cu8",
}  # fmt: skip
"""Sample type of files without metadata, by their ending."""


@dataclass(frozen=True)
class RecordingInfo:
    """What is known of a recording; rate and frequency only where it says so."""

    path: Path
    type: SampleType
    n_samples: int
    rate_hz: float | None
    frequency_hz: float | None
    damage: str
    """What is wrong with it without keeping it from being read."""


class RecordingReader:
    """Reads a recording piece by piece; nothing is loaded but the piece."""

    def __init__(self, info: RecordingInfo) -> None:
        self.info = info
        try:
            self._file = info.path.open("rb", buffering=0)
        except OSError as error:
            raise BackendError(f"{info.path}: cannot be read ({error.strerror})") from None

    def read(self, first: int, n: int) -> Samples:
        """Up to `n` samples from `first` on; fewer at the end."""
        size = self.info.type.size
        self._file.seek(first * size)
        data = self._file.read(max(0, min(n, self.info.n_samples - first)) * size)
        return self.info.type.decode(data[: len(data) - len(data) % size])

    def close(self) -> None:
        """Close the file."""
        self._file.close()


class RecordingWriter:
    """Writes a SigMF recording, sample by absolute index; what is skipped is silence.

    On most file systems, silence takes no room on the disk. Of cu8, zeros are not silence: refused.
    """

    def __init__(self, path: Path, type_name: str, rate_hz: float, frequency_hz: float) -> None:
        self._meta_path, data_path = sigmf_paths(path)
        self._type = sample_type(type_name, str(path))
        if self._type.offset:
            raise BackendError(f"{path}: {type_name} is only read; write ci8 instead")
        self._description = {
            "global": {
                "core:datatype": type_name,
                "core:sample_rate": rate_hz,
                "core:version": "1.2.0",
                "core:recorder": "sdrlinkd",
            },
            "captures": [
                {
                    "core:sample_start": 0,
                    "core:frequency": frequency_hz,
                    "core:datetime": datetime.datetime.now(datetime.UTC)
                    .isoformat(timespec="milliseconds")
                    .replace("+00:00", "Z"),
                }
            ],
            "annotations": [],
        }
        try:
            self._file = data_path.open("wb", buffering=0)
            self._meta_path.write_text(json.dumps(self._description, indent=2) + "\n")
        except OSError as error:
            raise BackendError(f"{error.filename}: cannot be written ({error.strerror})") from None
        self.clipped = 0

    def write(self, first: int, samples: Samples) -> None:
        """Put samples at index `first`. Raises BackendError when the disk will not take them."""
        data, clipped = self._type.encode(samples)
        self.clipped += clipped
        try:
            self._file.seek(first * self._type.size)
            self._file.write(data)
        except OSError as error:
            raise BackendError(f"{self._file.name}: cannot be written ({error.strerror})") from None

    def extend_to(self, end: int) -> None:
        """Make the recording `end` samples long, with silence."""
        size = end * self._type.size
        if not self._file.closed and self._file.seek(0, 2) < size:
            self._file.truncate(size)

    def close(self) -> None:
        """Close the files; closing twice is fine."""
        self._file.close()


def sigmf_paths(path: Path) -> tuple[Path, Path]:
    """(metadata, data) of the recording that `path`, with or without an ending, names."""
    name = str(path)
    for suffix in (META_SUFFIX, DATA_SUFFIX):
        name = name.removesuffix(suffix)
    return Path(name + META_SUFFIX), Path(name + DATA_SUFFIX)


def describe(path: Path, type_name: str = "", rate_hz: float | None = None) -> RecordingInfo:
    """What there is to know of the recording at `path`. Raises BackendError.

    SigMF by either of its files or the name without ending; any other file needs `type_name`, or an
    ending that tells it.
    """
    meta_path, data_path = sigmf_paths(path)
    if meta_path.is_file():
        return _from_sigmf(meta_path, data_path, type_name, rate_hz)
    if path.suffix in (META_SUFFIX, DATA_SUFFIX):
        raise BackendError(f"{meta_path}: no such file; SigMF needs both {meta_path} and its data")
    if not path.is_file():
        raise BackendError(f"{path}: no such recording")
    type_name = type_name or RAW_TYPES.get(path.suffix, "")
    if not type_name:
        raise BackendError(
            f"{path}: its sample type is not known; name one, or use a SigMF recording or one of "
            f"the endings {', '.join(RAW_TYPES)}"
        )
    return _described(path, sample_type(type_name, str(path)), rate_hz, None, [])


def _from_sigmf(
    meta_path: Path, data_path: Path, type_name: str, rate_hz: float | None
) -> RecordingInfo:
    try:
        meta: Any = json.loads(meta_path.read_text())
        general = meta["global"]
        captures = meta.get("captures", [])
        stated_type = general["core:datatype"]
        stated_rate = general.get("core:sample_rate")
        starts = [int(capture.get("core:sample_start", 0)) for capture in captures]
        frequency = captures[0].get("core:frequency") if captures else None
        channels = general.get("core:num_channels", 1)
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise BackendError(
            f"{meta_path}: not SigMF metadata ({type(error).__name__}: {error})"
        ) from None
    if channels != 1:
        raise BackendError(f"{meta_path}: core:num_channels: got {channels}; allowed: 1")
    for given, stated, key in (
        (type_name or None, stated_type, "core:datatype"),
        (rate_hz, stated_rate, "core:sample_rate"),
    ):
        if given is not None and stated is not None and given != stated:
            raise BackendError(f"{meta_path}: {key} is {stated}, but {given} was asked for")
    if stated_rate is not None and not (
        isinstance(stated_rate, int | float) and 0 < stated_rate < np.inf
    ):
        raise BackendError(f"{meta_path}: core:sample_rate: got {stated_rate}; allowed: above 0")
    if not data_path.is_file():
        raise BackendError(f"{data_path}: no such file; {meta_path.name} describes it")
    kind = sample_type(str(stated_type), f"{meta_path}: core:datatype")
    carrier = float(frequency) if isinstance(frequency, int | float) else None
    return _described(data_path, kind, stated_rate or rate_hz, carrier, starts)


def _described(
    path: Path, kind: SampleType, rate: float | None, frequency: float | None, starts: list[int]
) -> RecordingInfo:
    n_samples, rest = divmod(path.stat().st_size, kind.size)
    damage = []
    if rest:
        damage.append(f"{path}: ends with {rest} bytes that are no whole {kind.name} sample")
    if any(start > n_samples for start in starts):
        damage.append(
            f"{path}: holds {n_samples} samples, but a capture begins at {max(starts)}; it was cut"
        )
    return RecordingInfo(path, kind, n_samples, rate, frequency, "; ".join(damage))
