"""Compresses messages into zstd frames, and decompresses them within a size limit."""

from collections.abc import Iterable, Mapping

import zstandard

LEVEL = 3
MOST_RATIO = 64
"""Most octets of a message for each octet of its frame, where anybody can send one."""
ANY_RATIO_BYTES = 1 << 16
"""Largest message in octets for which the ratio does not matter."""
LEAST_BYTES = 64
"""Smallest message in bytes that is compressed without a dictionary."""


class Deflated:
    """Compresses the messages of one topic."""

    def __init__(self, dictionary: zstandard.ZstdCompressionDict | None) -> None:
        self._least = LEAST_BYTES if dictionary is None else 1
        self._zstd = zstandard.ZstdCompressor(
            level=LEVEL, dict_data=dictionary, write_content_size=True, write_checksum=False
        )

    def shrink(self, payload: bytes) -> bytes | None:
        """The message as a zstd frame; None if that is not smaller."""
        if len(payload) < self._least:
            return None
        frame = self._zstd.compress(payload)
        return frame if len(frame) < len(payload) else None


def most_expanded(frame: int) -> int:
    """The largest message in octets for a frame of `frame` octets, where anybody can send one.

    There, a larger one is sent uncompressed, and refused: a PDU full of such frames would keep a
    robot busy for milliseconds.
    """
    return max(ANY_RATIO_BYTES, MOST_RATIO * frame)


def train_dictionary(samples: Iterable[bytes], size: int) -> bytes:
    """A zstd dictionary of at most `size` bytes. Raises ValueError if there are too few samples."""
    try:
        return zstandard.train_dictionary(size, [*samples]).as_bytes()
    except zstandard.ZstdError as error:
        raise ValueError(str(error)) from None


class Inflated:
    """Decompresses messages; never beyond the size limit, whatever a frame's header says."""

    def __init__(self, dictionaries: Mapping[int, zstandard.ZstdCompressionDict]) -> None:
        self._by_id = {
            each.dict_id(): zstandard.ZstdDecompressor(dict_data=each)
            for each in dictionaries.values()
        }
        self._plain = zstandard.ZstdDecompressor()

    def expand(self, frame: bytes, most: int) -> tuple[bytes, str | None]:
        """(message, None), or (empty, the ledger's reason) if the frame cannot be decompressed."""
        try:
            told = zstandard.get_frame_parameters(frame)
            if told.content_size > most:
                return b"", "rx_inflates"
            zstd = self._by_id.get(told.dict_id) if told.dict_id else self._plain
            if zstd is None:
                return b"", "rx_no_dictionary"
            return zstd.decompress(frame, max_output_size=most, allow_extra_data=False), None
        except zstandard.ZstdError:
            return b"", "rx_bad_zstd"
