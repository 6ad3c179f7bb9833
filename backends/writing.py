"""Writes recordings: samples by index, described by SigMF metadata (sigmf.org)."""

import contextlib
import datetime
import json
import time
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from backends.base import BackendError, Samples
from backends.recording import reason, sigmf_paths
from backends.samples import sample_type

VERSION = "1.2.0"
"""The version of SigMF that recordings are written in."""


class Annotation(NamedTuple):
    """A note on `n` samples from `start` on, between two frequencies or over the whole band."""

    start: int
    n: int
    label: str
    comment: str
    edges_hz: tuple[float, float] | None = None


class RecordingWriter:
    """Writes a SigMF recording, sample by absolute index; skipped samples are silence.

    On most file systems, silence takes no disk space. cu8 is refused, because its zeros are not
    silence. `hardware`, `description` and `recorder` are for people.
    """

    def __init__(
        self,
        path: Path,
        type_name: str,
        rate_hz: float,
        frequency_hz: float,
        *,
        hardware: str = "",
        description: str = "",
        recorder: str = "sdrlinkd",
    ) -> None:
        self._meta_path, data_path = sigmf_paths(path)
        self._type = sample_type(type_name, str(path))
        if self._type.offset:
            raise BackendError(f"{path}: {type_name} is read-only; write ci8 instead")
        self._general = {
            "core:datatype": type_name,
            "core:sample_rate": rate_hz,
            "core:version": VERSION,
            "core:recorder": recorder,
            **({"core:hw": hardware} if hardware else {}),
            **({"core:description": description} if description else {}),
        }
        self._recorder = recorder
        self._frequency_hz = frequency_hz
        self._captures: dict[int, int] = {0: time.time_ns()}
        self.clipped = 0
        self.describe()
        try:
            self._file = data_path.open("w+b", buffering=0)
        except (OSError, ValueError) as error:
            raise _refusal(data_path, error) from None

    def begin_capture(self, first: int, at_ns: int) -> None:
        """Start a stretch without gaps at index `first`, recorded at this time (UTC)."""
        self._captures[first] = at_ns

    def write(self, first: int, samples: Samples) -> None:
        """Write samples at index `first`. Raises BackendError when the disk rejects them."""
        data, clipped = self._type.encode(samples)
        self.clipped += clipped
        rest = memoryview(data)
        try:
            self._file.seek(first * self._type.size)
            while rest:
                # An unbuffered file may accept only a part.
                rest = rest[self._file.write(rest) or 0 :]
        except OSError as error:
            self._end_with_a_whole_sample()
            raise _refusal(self._file.name, error) from None

    def read(self, first: int, n: int) -> Samples:
        """Read samples written so far. Raises BackendError."""
        try:
            self._file.seek(first * self._type.size)
            data = self._file.read(n * self._type.size)
        except OSError as error:
            raise BackendError(f"{self._file.name}: cannot be read ({reason(error)})") from None
        return self._type.decode(data[: len(data) - len(data) % self._type.size])

    def extend_to(self, end: int) -> None:
        """Extend the recording with silence to `end` samples. Raises BackendError."""
        if self._file.closed:
            return
        size = end * self._type.size
        try:
            if self._file.seek(0, 2) < size:
                self._file.truncate(size)
        except OSError as error:
            raise _refusal(self._file.name, error) from None

    def describe(self, annotations: Iterable[Annotation] = ()) -> None:
        """Write the metadata at once: a reader finds the old or the new. Raises BackendError."""
        text = json.dumps(self._metadata(annotations), indent=2) + "\n"
        part = self._meta_path.with_suffix(".sigmf-part")
        try:
            part.write_text(text)
            part.replace(self._meta_path)
        except (OSError, ValueError) as error:
            with contextlib.suppress(OSError, ValueError):
                part.unlink(missing_ok=True)
            raise _refusal(self._meta_path, error) from None

    def close(self) -> None:
        """Close the file; closing twice is fine."""
        self._file.close()

    def _metadata(self, annotations: Iterable[Annotation]) -> dict[str, object]:
        return {
            "global": self._general,
            "captures": [
                {
                    "core:sample_start": first,
                    "core:frequency": self._frequency_hz,
                    "core:datetime": _utc(at_ns),
                }
                for first, at_ns in sorted(self._captures.items())
            ],
            "annotations": [self._said(each) for each in sorted(annotations, key=_start)],
        }

    def _said(self, annotation: Annotation) -> dict[str, object]:
        said: dict[str, object] = {
            "core:sample_start": annotation.start,
            "core:sample_count": annotation.n,
            "core:label": annotation.label,
            "core:comment": annotation.comment,
            "core:generator": self._recorder,
        }
        if annotation.edges_hz is not None:
            said["core:freq_lower_edge"], said["core:freq_upper_edge"] = annotation.edges_hz
        return said

    def _end_with_a_whole_sample(self) -> None:
        with contextlib.suppress(OSError):
            end = self._file.seek(0, 2)
            self._file.truncate(end - end % self._type.size)


def _utc(at_ns: int) -> str:
    """The time in SigMF's format, with microseconds."""
    at = datetime.datetime.fromtimestamp(at_ns // 10**9, datetime.UTC)
    return f"{at:%Y-%m-%dT%H:%M:%S}.{at_ns % 10**9 // 1000:06d}Z"


def _start(annotation: Annotation) -> int:
    return annotation.start


def _refusal(path: Path | str, error: OSError | ValueError) -> BackendError:
    return BackendError(f"{path}: cannot be written ({reason(error)})")
