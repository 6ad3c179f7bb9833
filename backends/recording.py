"""Reads recordings of samples: a data file, described by SigMF metadata (sigmf.org)."""

import contextlib
import json
import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from backends.base import BackendError, Samples
from backends.samples import SampleType, sample_type

GAP_LABEL = "gap"
META_SUFFIX, DATA_SUFFIX = ".sigmf-meta", ".sigmf-data"
RAW_TYPES = {
    ".cf32": "cf32_le", ".fc32": "cf32_le", ".cfile": "cf32_le", ".c32": "cf32_le",
    ".ci16": "ci16_le", ".sc16": "ci16_le", ".i16": "ci16_le",
    ".ci8": "ci8", ".cs8": "ci8", ".sc8": "ci8", ".cu8": "cu8", ".u8": "cu8",
}  # fmt: skip
"""Sample type of files without metadata, by file name extension."""


@dataclass(frozen=True)
class RecordingInfo:
    """What is known of a recording; rate and frequency are None if it does not state them."""

    path: Path
    type: SampleType
    n_samples: int
    rate_hz: float | None
    frequency_hz: float | None
    damage: str
    """Defects that do not keep it from being read."""
    gaps: tuple[tuple[int, int], ...] = ()
    """(first, n) of missing samples, according to the annotations; they read as silence."""


class RecordingReader:
    """Reads a recording piece by piece, and keeps no more than one piece in memory."""

    def __init__(self, info: RecordingInfo) -> None:
        self.info = info
        try:
            self._file = info.path.open("rb", buffering=0)
        except OSError as error:
            raise BackendError(f"{info.path}: cannot be read ({error.strerror})") from None

    def read(self, first: int, n: int) -> Samples:
        """Up to `n` samples from `first` on; fewer at the end of the recording."""
        size = self.info.type.size
        self._file.seek(first * size)
        data = self._file.read(max(0, min(n, self.info.n_samples - first)) * size)
        return self.info.type.decode(data[: len(data) - len(data) % size])

    def close(self) -> None:
        """Close the data file."""
        self._file.close()


def refuse_same(receive: Path, transmit: Path) -> None:
    """Raise BackendError if both name the same recording: writing would empty it."""
    if sigmf_paths(receive)[1].resolve() == sigmf_paths(transmit)[1].resolve():
        raise BackendError(
            f"{transmit}: is being played and cannot be written to; name another recording"
        )


def sigmf_paths(path: Path) -> tuple[Path, Path]:
    """(metadata, data) of the recording that `path` names, with or without an extension."""
    name = str(path)
    for suffix in (META_SUFFIX, DATA_SUFFIX):
        name = name.removesuffix(suffix)
    return Path(name + META_SUFFIX), Path(name + DATA_SUFFIX)


def describe(path: Path, type_name: str = "", rate_hz: float | None = None) -> RecordingInfo:
    """Describe the recording at `path`. Raises BackendError.

    SigMF is found by either of its files or by the name without extension. Any other file needs
    `type_name`, or an extension that implies it.
    """
    meta_path, data_path = sigmf_paths(path)
    try:
        if meta_path.is_file():
            return _from_sigmf(meta_path, data_path, type_name, rate_hz)
        if path.suffix in (META_SUFFIX, DATA_SUFFIX):
            raise BackendError(
                f"{meta_path}: no such file; SigMF needs both {meta_path} and its data"
            )
        if not path.is_file():
            raise BackendError(f"{path}: no such recording")
        type_name = type_name or RAW_TYPES.get(path.suffix, "")
        if not type_name:
            raise BackendError(
                f"{path}: unknown sample type; name one, or use a SigMF recording or one "
                f"of the endings {', '.join(RAW_TYPES)}"
            )
        return _described(path, sample_type(type_name, str(path)), rate_hz, None, [])
    except (OSError, ValueError) as error:
        raise BackendError(f"{path}: cannot be read ({reason(error)})") from None


def _from_sigmf(
    meta_path: Path, data_path: Path, type_name: str, rate_hz: float | None
) -> RecordingInfo:
    try:
        meta: Any = json.loads(meta_path.read_text())
        general = meta["global"]
        captures = meta.get("captures", [])
        stated_type = str(general["core:datatype"])
        channels = general.get("core:num_channels", 1)
        starts = [capture.get("core:sample_start", 0) for capture in captures]
        gaps = _gaps(meta.get("annotations"))
        frequency = captures[0].get("core:frequency") if captures else None
        framed = [
            key
            for part in (general, *captures)
            for key in ("core:header_bytes", "core:trailing_bytes")
            if part.get(key)
        ]
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise BackendError(
            f"{meta_path}: not SigMF metadata ({type(error).__name__}: {error})"
        ) from None
    if framed:
        raise BackendError(f"{meta_path}: {framed[0]}: only data without headers is readable")
    if channels != 1:
        raise BackendError(f"{meta_path}: core:num_channels: got {channels}; allowed: 1")
    given_rate = general.get("core:sample_rate")
    stated_rate = _number(given_rate, f"{meta_path}: core:sample_rate", "above 0")
    if stated_rate is not None and stated_rate <= 0:
        raise BackendError(f"{meta_path}: core:sample_rate: got {given_rate}; allowed: above 0")
    if type_name and type_name != stated_type:
        raise BackendError(
            f"{meta_path}: core:datatype is {stated_type}, but {type_name} was requested"
        )
    if rate_hz is not None and stated_rate is not None and rate_hz != stated_rate:
        raise BackendError(
            f"{meta_path}: core:sample_rate is {stated_rate}, but {rate_hz} was requested"
        )
    if not data_path.is_file():
        raise BackendError(f"{data_path}: no such file; {meta_path.name} describes it")
    kind = sample_type(stated_type, f"{meta_path}: core:datatype")
    centre_hz = _number(frequency, f"{meta_path}: core:frequency")
    begins = [_number(each, f"{meta_path}: core:sample_start") or 0.0 for each in starts]
    described = _described(data_path, kind, stated_rate or rate_hz, centre_hz, begins)
    return replace(described, gaps=gaps)


def _gaps(annotations: object) -> tuple[tuple[int, int], ...]:
    """The gaps that our own annotations mark; other annotations are ignored."""
    found = []
    for each in annotations if isinstance(annotations, list) else []:
        if isinstance(each, dict) and each.get("core:label") == GAP_LABEL:
            start, n = each.get("core:sample_start"), each.get("core:sample_count")
            if isinstance(start, int) and isinstance(n, int):
                found.append((start, n))
    return tuple(found)


def _number(value: object, where: str, allowed: str = "a number") -> float | None:
    """A finite number from the metadata; None if it is absent."""
    if value is None:
        return None
    if isinstance(value, int | float) and not isinstance(value, bool):
        with contextlib.suppress(OverflowError):
            number = float(value)
            if math.isfinite(number):
                return number
    raise BackendError(f"{where}: got {str(value)[:40]}; allowed: {allowed}")


def reason(error: OSError | ValueError) -> str:
    """Why a file is not available, in words."""
    return error.strerror or str(error) if isinstance(error, OSError) else str(error)


def _described(
    path: Path, kind: SampleType, rate: float | None, frequency: float | None, starts: list[float]
) -> RecordingInfo:
    n_samples, rest = divmod(path.stat().st_size, kind.size)
    damage = []
    if rest:
        damage.append(f"{path}: ends with {rest} bytes, less than a {kind.name} sample")
    if any(start > n_samples for start in starts):
        damage.append(
            f"{path}: holds {n_samples} samples, but a capture begins at "
            f"{max(starts):.0f}; it is truncated"
        )
    return RecordingInfo(path, kind, n_samples, rate, frequency, "; ".join(damage))
