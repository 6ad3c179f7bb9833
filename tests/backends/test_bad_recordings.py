"""Recordings that cannot be used, or only in part, and the messages about them."""

import json
import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from backends import SAMPLE_TYPES, BackendError, RecordingReader, RecordingWriter, describe
from backends.testing import RAW_TYPES
from tests.backends.radios import RATE, noise, read, record
from tests.laws import law

GOOD = {
    "global": {"core:datatype": "ci8", "core:sample_rate": 1e6, "core:version": "1.2.0"},
    "captures": [{"core:sample_start": 0, "core:frequency": 868e6}],
    "annotations": [],
}
ALLOWED = ", ".join(SAMPLE_TYPES)


@pytest.fixture
def write(tmp_path):
    """Write a recording of 20 samples with the given metadata; returns its path."""

    def write(metadata=GOOD, data=bytes(40)):
        text = metadata if isinstance(metadata, str) else json.dumps(metadata)
        (tmp_path / "x.sigmf-meta").write_text(text)
        (tmp_path / "x.sigmf-data").write_bytes(data)
        return tmp_path / "x"

    return write


def with_global(**fields):
    changed = {f"core:{name}": value for name, value in fields.items()}
    return {**GOOD, "global": {**GOOD["global"], **changed}}


def with_capture(**fields):
    return {**GOOD, "captures": [{f"core:{name}": value for name, value in fields.items()}]}


def refusal(path, *arguments):
    """The reason why `path` cannot be described."""
    with pytest.raises(BackendError) as error:
        describe(path, *arguments)
    return str(error.value)


@pytest.mark.parametrize("given_type", ["rf32_le", "ri16_le", "cf64_le", "ci16_be", "", 5, None])
def test_a_type_that_is_not_read_is_named_with_those_that_are(write, given_type):
    path = write(with_global(datatype=given_type))
    wanted = (
        f'{path}.sigmf-meta: core:datatype: sample type: got "{given_type}"; allowed: {ALLOWED}'
    )
    assert refusal(path) == wanted


def test_a_type_asked_for_that_does_not_exist_is_named(tmp_path):
    path = tmp_path / "bare.cf32"
    path.write_bytes(bytes(8))
    assert refusal(path, "cf128") == f'{path}: sample type: got "cf128"; allowed: {ALLOWED}'
    with pytest.raises(BackendError, match=r'sent: sample type: got "cf128"; allowed: cf32_le, '):
        RecordingWriter(tmp_path / "sent", "cf128", RATE, 0)
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    "annotations", [None, 5, [5], [{}], [{"core:label": "gap", "core:sample_start": 1e400}]]
)
def test_odd_annotations_are_of_no_matter(write, annotations):
    assert describe(write({**GOOD, "annotations": annotations})).gaps == ()


def test_a_bare_file_of_unknown_ending_needs_a_type(tmp_path):
    path = tmp_path / "bare.bin"
    path.write_bytes(bytes(8))
    text = refusal(path)
    assert text.startswith(f"{path}: ")
    assert all(ending in text for ending in RAW_TYPES)


def test_missing_files_are_named(write, tmp_path):
    assert refusal(tmp_path / "none") == f"{tmp_path / 'none'}: no such recording"
    assert refusal(tmp_path) == f"{tmp_path}: no such recording"
    path = write()
    meta, data = tmp_path / "x.sigmf-meta", tmp_path / "x.sigmf-data"
    data.unlink()
    for name in (path, meta, data):
        assert refusal(name) == f"{data}: no such file; x.sigmf-meta describes it"
    meta.unlink()
    for name in (meta, data):
        assert refusal(name).startswith(f"{meta}: no such file; SigMF needs both {meta} ")


@pytest.mark.parametrize("text", ["", "{", "not json", "{'a': 1}", "[" * 100_000, "9" * 5000])
def test_what_is_not_json_is_not_metadata(write, text):
    path = write(text)
    assert refusal(path).startswith(f"{path}.sigmf-meta: not SigMF metadata (")


def test_octets_that_are_no_text_are_not_metadata(write):
    path = write()
    path.with_suffix(".sigmf-meta").write_bytes(b"\xff\xfe{}")
    assert "x.sigmf-meta: not SigMF metadata (UnicodeDecodeError" in refusal(path)


leaves = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.floats(allow_infinity=False),
    st.text(max_size=8),
    st.sampled_from(["ci8", "cf32_le", 0, 1, -1, 1e6]),
)
any_json = st.recursive(
    leaves,
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(st.sampled_from(["global", "captures", "core:datatype", "a"]), inner)
    ),
    max_leaves=12,
)
nearly = st.fixed_dictionaries(
    {
        "global": any_json
        | st.fixed_dictionaries(
            {"core:datatype": st.sampled_from(["ci8", "cf32_le"]) | any_json},
            optional={"core:sample_rate": any_json, "core:num_channels": st.just(1) | any_json},
        )
    },
    optional={
        "captures": any_json
        | st.lists(
            st.fixed_dictionaries(
                {}, optional={"core:sample_start": any_json, "core:frequency": any_json}
            ),
            max_size=3,
        ),
        "annotations": any_json,
    },
)


@pytest.fixture(scope="module")
def hostile(tmp_path_factory):
    """A folder with 40 octets of data."""
    folder = tmp_path_factory.mktemp("hostile")
    (folder / "x.sigmf-data").write_bytes(bytes(40))
    return folder


def described(path, *arguments):
    """The description of a recording, or the reason why there is none."""
    try:
        return describe(path, *arguments)
    except BackendError as error:
        return str(error)


@pytest.mark.slow
@law(250)
@given(any_json | nearly, st.sampled_from(["", "ci8"]), st.sampled_from([None, 1e6]))
def test_any_json_is_read_or_refused_in_words(hostile, metadata, type_name, rate_hz):
    (hostile / "x.sigmf-meta").write_text(json.dumps(metadata))
    info = described(hostile / "x", type_name, rate_hz)
    if isinstance(info, str):
        assert info.startswith(str(hostile / "x"))
    else:
        assert info.n_samples == 40 // info.type.size
        assert info.rate_hz is None or info.rate_hz > 0


@pytest.mark.parametrize(
    "metadata",
    [with_capture(sample_start=float("inf")), with_capture(frequency=10**400)],
    ids=["sample_start", "frequency"],
)
def test_numbers_too_large_for_their_type_are_refused_in_words(write, metadata):
    assert "x.sigmf-meta" in refusal(write(metadata))


@pytest.mark.parametrize(
    ("rate", "text"), [(0, "0"), (-1e6, "-1000000.0"), ("fast", "fast"), ([], r"[]")]
)
def test_a_rate_that_is_none_is_refused(write, rate, text):
    path = write(with_global(sample_rate=rate))
    wanted = f"{path}.sigmf-meta: core:sample_rate: got {text}; allowed: above 0"
    assert refusal(path) == wanted


def test_a_rate_no_float_can_hold_is_refused(write):
    path = write(with_global(sample_rate=10**400))
    assert "x.sigmf-meta: " in refusal(path)


def test_recordings_of_several_channels_are_refused(write):
    path = write(with_global(num_channels=2))
    assert refusal(path) == f"{path}.sigmf-meta: core:num_channels: got 2; allowed: 1"


def test_what_is_asked_for_must_be_what_the_metadata_says(write):
    path = write()
    wanted = f"{path}.sigmf-meta: core:sample_rate is 1000000.0, but 2000000.0 was requested"
    assert refusal(path, "", 2e6) == wanted
    wanted = f"{path}.sigmf-meta: core:datatype is ci8, but ci16_le was requested"
    assert refusal(path, "ci16_le") == wanted
    assert describe(path, "ci8", 1e6).n_samples == 20


@pytest.mark.parametrize(("type_name", "rest"), [("ci8", 1), ("ci16_le", 3), ("cf32_le", 7)])
def test_half_a_sample_at_the_end_is_damage_that_does_not_keep_from_reading(
    tmp_path, type_name, rest
):
    record(tmp_path / "cut", noise(10), type_name)
    whole = read(tmp_path / "cut")
    data = tmp_path / "cut.sigmf-data"
    os.truncate(data, data.stat().st_size - SAMPLE_TYPES[type_name].size + rest)
    wanted = f"{data}: ends with {rest} bytes, less than a {type_name} sample"
    assert describe(tmp_path / "cut").damage == wanted
    assert np.array_equal(read(tmp_path / "cut"), whole[:9])


def test_a_capture_beyond_the_end_is_damage(write):
    path = write(with_capture(sample_start=20))
    assert not describe(path).damage
    damage = describe(write(with_capture(sample_start=21))).damage
    wanted = "x.sigmf-data: holds 20 samples, but a capture begins at 21; it is truncated"
    assert damage.endswith(wanted)
    both = describe(write(with_capture(sample_start=21), bytes(39))).damage
    assert both.count("x.sigmf-data") == 2


def test_a_recording_that_shrinks_while_it_is_read_ends_early(tmp_path):
    record(tmp_path / "x", noise(100))
    reader = RecordingReader(describe(tmp_path / "x"))
    os.truncate(tmp_path / "x.sigmf-data", 8 * 60 + 3)
    assert np.array_equal(reader.read(50, 50), noise(100)[50:60])
    assert len(reader.read(70, 10)) == 0
    reader.close()


def test_a_recording_gone_since_it_was_described_cannot_be_read(tmp_path):
    record(tmp_path / "x", noise(1))
    info = describe(tmp_path / "x")
    info.path.unlink()
    with pytest.raises(BackendError, match=r"x.sigmf-data: cannot be read \(No such file"):
        RecordingReader(info)


def test_files_one_may_not_read_are_named(own_rights):
    record(Path("x"), noise(1))
    Path("x.sigmf-data").chmod(0)
    info = describe(Path("x"))
    with pytest.raises(BackendError, match=r"x.sigmf-data: cannot be read \(Permission denied\)"):
        RecordingReader(info)
    Path("x.sigmf-meta").chmod(0)
    assert refusal(Path("x")).startswith("x.sigmf-meta: not SigMF metadata (PermissionError")


def test_a_folder_one_may_not_enter_is_named(own_rights):
    Path("shut").mkdir(mode=0)
    assert "shut/x" in refusal(Path("shut/x"))


def test_a_name_too_long_for_the_disk_is_refused_in_words(tmp_path):
    assert "too long" in refusal(tmp_path / ("x" * 300))
