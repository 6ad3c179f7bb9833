"""Recordings that cannot be written."""

import asyncio
import gc
import re
import resource
import warnings
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from backends import BackendError, IqFileRadio, RecordingWriter, TxBurst, TxOutcome
from tests.backends.radios import (
    AIR,
    BLOCK_S,
    RATE,
    TUNING,
    hand_over,
    noise,
    opened,
    read,
    record,
    take,
)


@contextmanager
def room_for(size):
    """Limit the size of every file to `size` bytes."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def writer(path):
    return RecordingWriter(path, "cf32_le", RATE, 0)


def transmitter(path):
    return IqFileRadio(None, path, AIR, BLOCK_S, paced=False, type_name="cf32_le")


def refusal(path):
    """The reason why nothing can be recorded in `path`."""
    with pytest.raises(BackendError) as error:
        writer(path)
    return str(error.value)


@pytest.fixture
def full(tmp_path):
    """A recording on a full disk."""
    (tmp_path / "full.sigmf-data").symlink_to("/dev/full")
    return tmp_path / "full"


def test_a_folder_that_does_not_take_a_recording_is_named(tmp_path):
    assert re.fullmatch(
        rf"{tmp_path}/none/x.sigmf-(data|meta): cannot be written \(No such file or directory\)",
        refusal(tmp_path / "none" / "x"),
    )
    (tmp_path / "file").touch()
    assert "cannot be written (Not a directory)" in refusal(tmp_path / "file" / "x")
    (tmp_path / "folder.sigmf-data").mkdir()
    assert "folder.sigmf-data: cannot be written (Is a directory)" in refusal(tmp_path / "folder")
    assert "cannot be written (File name too long)" in refusal(tmp_path / ("x" * 300))


def test_a_folder_one_may_not_write_in_is_named(own_rights):
    Path("shut").mkdir(mode=0o500)
    wanted = r"shut/x.sigmf-(data|meta): cannot be written \(Permission denied\)"
    assert re.fullmatch(wanted, refusal(Path("shut/x")))


async def test_a_radio_that_cannot_record_does_not_open(tmp_path):
    record(tmp_path / "played", noise(10))
    radio = IqFileRadio(tmp_path / "played", tmp_path / "none" / "x", AIR, BLOCK_S)
    with pytest.raises(BackendError, match=r"none/x.sigmf-.*: cannot be written \(No such file"):
        async with opened(radio):
            pass
    report = await radio.send(TxBurst(0, noise(10)))
    assert report.outcome is TxOutcome.LOST


def test_a_recording_without_metadata_is_not_left_open(tmp_path):
    (tmp_path / "x.sigmf-meta").mkdir()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        assert "x.sigmf-meta: cannot be written (Is a directory)" in refusal(tmp_path / "x")
        gc.collect()
    assert not caught


def test_a_full_disk_is_named(full):
    recording = writer(full)
    with pytest.raises(BackendError, match=r"full.sigmf-data: cannot be written \(No space left"):
        recording.write(0, noise(10))
    recording.close()


def test_a_disk_that_takes_a_part_is_named(tmp_path):
    recording = writer(tmp_path / "x")
    try:
        with room_for(1000), pytest.raises(BackendError, match=r"x.sigmf-data: cannot be written"):
            recording.write(0, noise(1000))
    finally:
        recording.close()


def test_a_disk_without_room_for_silence_is_named(tmp_path):
    recording = writer(tmp_path / "x")
    try:
        with room_for(1000), pytest.raises(BackendError, match=r"x.sigmf-data: cannot be written"):
            recording.extend_to(1000)
    finally:
        recording.close()


async def test_a_radio_says_in_its_blocks_that_the_disk_is_full(tmp_path, monkeypatch):
    def refuse(self, first, samples):
        raise BackendError("no room")

    async with opened(transmitter(tmp_path / "x")) as radio:
        monkeypatch.setattr(RecordingWriter, "write", refuse)
        sends = await hand_over(radio, [TxBurst(0, noise(10))])
        with pytest.raises(BackendError, match="no room"):
            await take(radio.blocks())
    assert (await sends[0]).outcome is TxOutcome.LOST


async def test_bursts_are_lost_as_soon_as_the_disk_is_full(tmp_path, monkeypatch):
    def refuse(self, first, samples):
        raise BackendError("no room")

    async with opened(transmitter(tmp_path / "x")) as radio:
        monkeypatch.setattr(RecordingWriter, "write", refuse)
        sends = await hand_over(radio, [TxBurst(0, noise(10))])
        with pytest.raises(BackendError, match="no room"):
            await take(radio.blocks())
        report = await asyncio.wait_for(sends[0], 0.5)
        assert report.outcome is TxOutcome.LOST


async def test_a_radio_whose_disk_is_full_can_be_closed(full, monkeypatch):
    radio = transmitter(full)
    await radio.open(TUNING)
    sends = await hand_over(radio, [TxBurst(0, noise(10))])
    with pytest.raises(BackendError, match="No space left"):
        await take(radio.blocks())
    await radio.close()
    assert (await sends[0]).outcome is TxOutcome.LOST


async def test_values_too_large_are_clipped_and_counted(tmp_path):
    radio = IqFileRadio(None, tmp_path / "x", AIR, BLOCK_S, paced=False, type_name="ci8")
    loud = np.full(50, 1000 + 1000j, np.complex64)
    async with opened(radio):
        sends = await hand_over(radio, [TxBurst(0, loud)])
        await take(radio.blocks(), 50)
        await sends[0]
        assert radio.counters == {"late": 0, "clipped": 100}
    assert np.abs(read(tmp_path / "x").view(np.float32)).max() <= 1
