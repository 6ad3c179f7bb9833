"""Small bags that would expand without end."""

import shutil
import sqlite3
import struct
import subprocess
import sys
from contextlib import closing
from types import SimpleNamespace

import lz4.frame
import mcap.writer
import pytest
import zstandard
from mcap.writer import CompressionType, IndexType, Writer

from sdrlinkd.adapters import open_bag
from sdrlinkd.adapters.testing import CONSTANTS
from sdrlinkd.errors import BagError

GIGABYTES = 3
MCAP_MAGIC = b"\x89MCAP0\r\n"
MOST_BYTES = 1 << 31


def zeros(n):
    """A zstd frame of n GiB of zeros, some hundred kilobytes long."""
    compressor = zstandard.ZstdCompressor(level=3).compressobj()
    block = bytes(1 << 24)
    parts = [compressor.compress(block) for _ in range(64 * n)]
    return b"".join([*parts, compressor.flush()])


@pytest.fixture(scope="module")
def bomb():
    return zeros(GIGABYTES)


@pytest.mark.long
def test_a_chunk_of_an_mcap_file(tmp_path, bomb):
    """Within 2 GiB of memory, where the whole chunk would take 3."""
    name = b"zstd"
    chunk = struct.pack("<QQQI", 0, 0, GIGABYTES << 30, 0) + struct.pack("<I", len(name)) + name
    content = chunk + struct.pack("<Q", len(bomb)) + bomb
    path = tmp_path / "cut.mcap"
    path.write_bytes(MCAP_MAGIC + struct.pack("<BQ", 6, len(content)) + content)
    program = (
        "import resource, sys; from pathlib import Path;"
        "from sdrlinkd.adapters import open_bag; from sdrlinkd.errors import BagError\n"
        "try: open_bag(Path(sys.argv[1]))\n"
        "except BagError as error: print(error)\n"
        "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, str(path)], capture_output=True, text=True, check=True,
    )  # fmt: skip
    said, peak_kib = done.stdout.splitlines()[-2:]
    assert "nothing in it can be recovered" in said
    assert int(peak_kib) << 10 < MOST_BYTES


@pytest.mark.slow
@pytest.mark.parametrize("says_its_size", [False, True])
def test_a_compressed_database(tmp_path, bomb, monkeypatch, says_its_size):
    folder = tmp_path / "bag"
    folder.mkdir()
    frame = bomb
    if says_its_size:
        frame = zstandard.ZstdCompressor().compress(bytes(1 << 24))
    (folder / "bag.db3.zstd").write_bytes(frame)
    monkeypatch.setattr(shutil, "disk_usage", lambda _: SimpleNamespace(free=1 << 24))
    with pytest.raises(BagError, match=r"expands to more than 8388608 bytes"):
        open_bag(folder)


def test_a_view_without_end(tmp_path, monkeypatch):
    monkeypatch.setattr(*CONSTANTS["most_steps"], 1 << 22)
    path = tmp_path / "cut.db3"
    with sqlite3.connect(path) as database:
        database.execute("CREATE TABLE topics (id, name, type)")
        database.execute("INSERT INTO topics VALUES (1, 'odom', 'nav_msgs/msg/Odometry')")
        database.execute(
            "CREATE VIEW messages AS WITH RECURSIVE n(i) AS "
            "(SELECT 1 UNION ALL SELECT i + 1 FROM n) "
            "SELECT i AS rowid, 7 AS topic_id, i AS timestamp, x'00' AS data FROM n"
        )
    database.close()
    with pytest.raises(BagError, match="nothing in it can be recovered"):
        open_bag(path)


def lz4_zeros(n_bytes):
    """An LZ4 frame that does not say its size."""
    frame = lz4.frame.LZ4FrameCompressor()
    return frame.begin() + frame.compress(bytes(n_bytes)) + frame.flush()


def zstd_zeros(n_bytes):
    return zstandard.ZstdCompressor(write_content_size=False).compress(bytes(n_bytes))


BOMBS = {CompressionType.LZ4: lz4_zeros, CompressionType.ZSTD: zstd_zeros}


@pytest.mark.parametrize(
    ("indexed", "says"),
    [
        (IndexType.ALL, r"a chunk of more than 1048576 bytes|did not decompress full frame"),
        (IndexType.ALL & ~IndexType.CHUNK, "no chunk is in the index"),
    ],
)
@pytest.mark.parametrize("compression", BOMBS)
def test_a_chunk_of_an_indexed_mcap_file_that_says_it_is_small(
    tmp_path, monkeypatch, compression, indexed, says
):
    monkeypatch.setattr(*CONSTANTS["most_in_chunk"], 1 << 20)
    packed = BOMBS[compression](1 << 22)
    small = SimpleNamespace(compress=lambda _: packed)
    monkeypatch.setattr(mcap.writer, "lz4", SimpleNamespace(frame=small))
    monkeypatch.setattr(mcap.writer, "zstandard", small)
    path = tmp_path / "one.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream, compression=compression, index_types=indexed)
        writer.start("ros1", "a test")
        number = writer.register_schema("std_msgs/String", "ros1msg", b"string data")
        writer.add_message(writer.register_channel("/say", "ros1", number), 0, bytes(1 << 11), 0)
        writer.finish()
    with pytest.raises(BagError, match=says):  # noqa: PT012
        with closing(open_bag(path)) as bag:
            list(bag.messages())
        raise BagError(bag.damage)
