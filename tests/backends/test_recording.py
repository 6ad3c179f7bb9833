"""Recordings of samples: written, read, and accepted by SigMF's own package."""

import itertools
import json

import numpy as np
import pytest
import sigmf
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from backends import SAMPLE_TYPES, BackendError, RecordingReader, RecordingWriter, describe
from backends.testing import RAW_TYPES
from tests.backends.radios import RATE, TUNING, noise, read, record
from tests.laws import law

WRITTEN = ("cf32_le", "ci16_le", "ci8")
some_parts = arrays(
    np.float32,
    st.integers(0, 60).map(lambda n: 2 * n),
    elements={"min_value": -2, "max_value": 2},
)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """(samples, path of their recording)."""
    path = tmp_path_factory.mktemp("recorded") / "some"
    samples = noise(1000)
    record(path, samples)
    return samples, path


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """One folder for all examples of a property."""
    return tmp_path_factory.mktemp("recordings")


@law(60)
@given(some_parts)
def test_floats_come_back_as_they_were(folder, parts):
    samples = parts.view(np.complex64)
    assert record(folder / "f", samples) == 0
    assert np.array_equal(read(folder / "f"), samples)


@pytest.mark.parametrize(("type_name", "full_scale"), [("ci16_le", 32768), ("ci8", 128)])
@law(60)
@given(some_parts)
def test_integers_come_back_to_half_a_step_or_are_clipped_and_counted(
    folder, type_name, full_scale, parts
):
    clipped = record(folder / type_name, parts.view(np.complex64), type_name)
    back = read(folder / type_name).view(np.float32)
    nearest = np.round(parts * full_scale)
    beyond = (nearest < -full_scale) | (nearest > full_scale - 1)
    assert clipped == np.count_nonzero(beyond)
    assert np.all(np.abs(back - parts)[~beyond] <= 0.5 / full_scale)
    assert np.all(back[beyond] == np.where(parts > 0, 1 - 1 / full_scale, -1)[beyond])


def test_what_is_no_number_is_silence_and_what_is_infinite_full_scale(tmp_path):
    samples = np.array([complex(np.nan, 0.5), complex(np.inf, -np.inf), 1e38], np.complex64)
    assert record(tmp_path / "odd", samples, "ci8") == 3
    assert read(tmp_path / "odd").tolist() == [0.5j, complex(127 / 128, -1), 127 / 128]


@pytest.mark.parametrize(
    ("type_name", "width", "full_scale"), [("ci16_le", 2, 32768), ("ci8", 1, 128)]
)
def test_stored_integers_are_shares_of_full_scale(tmp_path, type_name, width, full_scale):
    values = [0, 1, -1, full_scale - 1, -full_scale, 5]
    data = b"".join(value.to_bytes(width, "little", signed=True) for value in values)
    path = tmp_path / "raw"
    path.write_bytes(data)
    wanted = np.array(values, np.float32) / full_scale
    assert np.array_equal(read(path, type_name).view(np.float32), wanted)


def test_the_octets_of_rtl_sdr_are_read(tmp_path):
    path = tmp_path / "rtl.cu8"
    path.write_bytes(bytes([0, 255, 127, 128]))
    wanted = np.array([-127.5, 127.5, -0.5, 0.5], np.float32) / 128
    assert np.array_equal(read(path).view(np.float32), wanted)


def test_octets_without_a_sign_are_not_written(tmp_path):
    """Skipped samples would be zero octets, which are not silence in unsigned types."""
    with pytest.raises(BackendError, match="sent: cu8 is read-only; write ci8 instead"):
        RecordingWriter(tmp_path / "sent", "cu8", RATE, 0)


@pytest.mark.parametrize("type_name", SAMPLE_TYPES)
def test_a_recording_without_samples_is_read(tmp_path, type_name):
    path = tmp_path / "empty"
    path.write_bytes(b"")
    assert read(path, type_name).shape == (0,)


@pytest.mark.parametrize("type_name", SAMPLE_TYPES)
def test_samples_are_complex_numbers_that_may_be_written_to(tmp_path, type_name):
    path = tmp_path / "raw"
    path.write_bytes(bytes(range(64)))
    samples = read(path, type_name)
    assert samples.dtype == np.complex64
    samples *= 2


@law(60)
@given(st.lists(st.integers(0, 300), max_size=15))
def test_any_pieces_read_are_the_same_samples(recorded, sizes):
    samples, path = recorded
    reader = RecordingReader(describe(path))
    edges = [0, *itertools.accumulate(sizes)]
    pieces = [reader.read(first, n) for first, n in zip(edges, sizes, strict=False)]
    reader.close()
    assert np.array_equal(np.concatenate([samples[:0], *pieces]), samples[: edges[-1]])


@law(60)
@given(st.lists(st.tuples(st.integers(0, 1200), st.integers(0, 1200)), max_size=8))
def test_pieces_are_read_in_any_order(recorded, pieces):
    samples, path = recorded
    reader = RecordingReader(describe(path))
    for first, n in pieces:
        assert np.array_equal(reader.read(first, n), samples[first : first + n])
    reader.close()


@law(60)
@given(
    st.lists(st.tuples(st.integers(0, 500), st.integers(1, 80)), max_size=8),
    st.sampled_from(WRITTEN),
    st.integers(0, 900),
)
def test_what_is_skipped_is_silence(folder, pieces, type_name, end):
    writer = RecordingWriter(folder / "gaps", type_name, RATE, 0)
    wanted = np.zeros(max([end, *(first + n for first, n in pieces)]), np.complex64)
    for first, n in pieces:
        samples = np.full(n, 0.25 - 0.5j, np.complex64)
        writer.write(first, samples)
        wanted[first : first + n] = samples
    writer.extend_to(end)
    writer.close()
    assert np.array_equal(read(folder / "gaps"), wanted)


def test_extending_to_less_than_there_is_changes_nothing(tmp_path):
    writer = RecordingWriter(tmp_path / "sent", "cf32_le", RATE, 0)
    writer.write(0, noise(50))
    writer.extend_to(20)
    writer.close()
    writer.extend_to(80)
    writer.close()
    assert np.array_equal(read(tmp_path / "sent"), noise(50))


def test_a_new_recording_takes_the_place_of_the_old(tmp_path):
    record(tmp_path / "again", noise(100))
    record(tmp_path / "again", noise(10), "ci8")
    assert describe(tmp_path / "again").n_samples == 10


@pytest.mark.parametrize("ending", ["", ".sigmf-meta", ".sigmf-data"])
def test_a_recording_is_found_by_any_of_its_names(tmp_path, ending):
    record(tmp_path / f"some.name{ending}", noise(70), "ci16_le")
    for name in ("some.name", "some.name.sigmf-meta", "some.name.sigmf-data"):
        info = describe(tmp_path / name)
        assert info.path == tmp_path / "some.name.sigmf-data"
        assert (info.type.name, info.n_samples) == ("ci16_le", 70)
        assert (info.rate_hz, info.frequency_hz) == (RATE, TUNING.frequency_hz)
        assert not info.damage


@pytest.mark.parametrize(("ending", "type_name"), RAW_TYPES.items())
def test_a_bare_file_is_known_by_its_ending(tmp_path, ending, type_name):
    path = tmp_path / f"bare{ending}"
    path.write_bytes(bytes(160))
    info = describe(path, rate_hz=5e6)
    assert (info.type.name, info.n_samples) == (type_name, 160 // info.type.size)
    assert (info.rate_hz, info.frequency_hz) == (5e6, None)


def test_the_type_asked_for_counts_more_than_the_ending_of_a_bare_file(tmp_path):
    path = tmp_path / "bare.cf32"
    path.write_bytes(bytes(160))
    assert describe(path, "ci8").n_samples == 80


def test_metadata_may_leave_out_all_but_the_type(tmp_path):
    (tmp_path / "a.sigmf-data").write_bytes(bytes(8))
    (tmp_path / "a.sigmf-meta").write_text('{"global": {"core:datatype": "ci8"}}')
    info = describe(tmp_path / "a")
    assert (info.n_samples, info.rate_hz, info.frequency_hz, info.damage) == (4, None, None, "")
    assert describe(tmp_path / "a", rate_hz=2e6).rate_hz == 2e6


@pytest.mark.parametrize("type_name", WRITTEN)
def test_what_we_write_is_valid_sigmf(tmp_path, type_name):
    record(tmp_path / "ours", noise(300), type_name)
    theirs = sigmf.sigmffile.fromfile(tmp_path / "ours.sigmf-meta")
    theirs.validate()
    # Their package adds the missing parts of what it reads.
    sigmf.validate.validate(json.loads((tmp_path / "ours.sigmf-meta").read_text()))
    assert theirs.get_global_field("core:sample_rate") == RATE
    assert theirs.get_capture_info(0)["core:frequency"] == TUNING.frequency_hz
    assert theirs.get_capture_info(0)["core:datetime"].endswith("Z")
    assert np.array_equal(theirs.read_samples(), read(tmp_path / "ours"))
    assert np.array_equal(theirs.read_samples(100, 50), read(tmp_path / "ours")[100:150])


@pytest.mark.parametrize(
    ("type_name", "dtype"), [("cf32_le", "<f4"), ("ci16_le", "<i2"), ("ci8", "i1"), ("cu8", "u1")]
)
def test_what_their_package_writes_is_read(tmp_path, type_name, dtype):
    values = np.random.default_rng(1).integers(0, 120, 400).astype(dtype)
    values.tofile(tmp_path / "theirs.sigmf-data")
    theirs = sigmf.SigMFFile(
        data_file=tmp_path / "theirs.sigmf-data",
        global_info={"core:datatype": type_name, "core:sample_rate": 2_400_000},
    )
    theirs.add_capture(0, {"core:frequency": 433_920_000})
    theirs.add_annotation(10, 20, {"core:label": "burst"})
    theirs.tofile(tmp_path / "theirs")
    info = describe(tmp_path / "theirs")
    assert (info.n_samples, info.rate_hz, info.frequency_hz) == (200, 2.4e6, 433.92e6)
    assert not info.damage
    # Our octets are centred on 127.5, like the converter's; theirs on 128.
    centre = (0.5 + 0.5j) / 128 if type_name == "cu8" else 0
    assert np.array_equal(read(tmp_path / "theirs"), theirs.read_samples() + np.complex64(centre))


def test_samples_their_package_writes_from_an_array_are_read(tmp_path):
    sigmf.fromarray(noise(64)).tofile(tmp_path / "theirs")
    assert np.array_equal(read(tmp_path / "theirs"), noise(64))


def test_the_metadata_is_json_a_person_can_read(tmp_path):
    record(tmp_path / "ours", noise(1))
    text = (tmp_path / "ours.sigmf-meta").read_text()
    assert len(text.splitlines()) > 10
    assert set(json.loads(text)) == {"global", "captures", "annotations"}
