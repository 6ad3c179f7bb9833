"""Bounds on what a damaged bag may take: a few bytes can expand to gigabytes."""

MOST_BYTES = 1 << 28
"""Most octets of one chunk or message, decompressed."""
MOST_ROWS = 10_000_000
"""Most rows that are read from a database."""
MOST_STEPS = 1 << 30
"""Most steps of SQLite's machine for one query."""
PIECE = 1 << 20
"""Octets that are decompressed at once."""
ZSTD_HEADER_BYTES = 18
"""Most octets of a zstd frame's header, which may say how much it holds."""
