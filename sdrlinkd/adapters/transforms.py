"""Reduces /tf for a slow link: selected frames, unique names per robot, combined messages."""

from fnmatch import fnmatchcase
from typing import Any

from sdrlinkd.adapters.typestore import from_cdr, ros2_types, to_cdr
from sdrlinkd.config import TF_TYPE, TransformParams
from sdrlinkd.errors import CdrError


class Transforms:
    """Selects, renames and combines the transforms of one outgoing topic."""

    def __init__(self, params: TransformParams) -> None:
        self._params = params
        self._latest: dict[str, Any] = {}
        self._due_at = float("-inf")

    def take(self, payload: bytes, now: float) -> tuple[bytes | None, str]:
        """(the message to send now, ""), or (None, the ledger's reason for sending none)."""
        try:
            message = from_cdr(payload, TF_TYPE)
        except CdrError:
            return None, "tx_bad_transform"
        wanted = [each for each in message.transforms if self._wants(each.child_frame_id)]
        if not wanted:
            return None, "tx_filtered"
        for each in wanted:
            self._latest[each.child_frame_id] = self._named(each)
        gathered = self.flush(now)
        return gathered, "" if gathered is not None else "tx_combined"

    def flush(self, now: float) -> bytes | None:
        """The combined transforms as one message if one is due; else None."""
        if not self._latest or now < self._due_at:
            return None
        self._due_at = now + self._params.combine_s
        return self._message()

    def _message(self) -> bytes:
        gathered, self._latest = list(self._latest.values()), {}
        return to_cdr(ros2_types().types[TF_TYPE](gathered), TF_TYPE)

    def _wants(self, frame: str) -> bool:
        name = frame.removeprefix("/")
        params = self._params
        kept = not params.frames or any(fnmatchcase(name, each) for each in params.frames)
        return kept and not any(fnmatchcase(name, each) for each in params.drop)

    def _named(self, transform: Any) -> Any:  # noqa: ANN401
        prefix = self._params.prefix
        if prefix:
            header = transform.header
            header.frame_id = self._name(header.frame_id)
            transform.child_frame_id = self._name(transform.child_frame_id)
        return transform

    def _name(self, frame: str) -> str:
        name = frame.removeprefix("/")
        return name if name in self._params.shared else f"{self._params.prefix}{name}"
