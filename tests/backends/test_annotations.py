"""Annotations of a recording, and when a reader sees them."""

import json

import pytest
import sigmf

from backends import GAP_LABEL, Annotation, BackendError, RecordingWriter, describe
from tests.backends.radios import RATE, TUNING, noise, read

BURST = Annotation(20, 30, "burst", "QPSK 1/2", (867.9e6, 868.1e6))
GAP = Annotation(5, 10, GAP_LABEL, "the radio lost samples")
EPOCH_NS = 1_700_000_000_123_456_789


def metadata(path):
    return json.loads(path.with_suffix(".sigmf-meta").read_text())


@pytest.fixture
def annotated(tmp_path):
    """A recording with every possible annotation."""
    writer = RecordingWriter(
        tmp_path / "rec", "ci16_le", RATE, TUNING.frequency_hz,
        hardware="a radio", description="a test", recorder="tests 1",
    )  # fmt: skip
    writer.begin_capture(0, EPOCH_NS)
    writer.write(0, noise(100))
    writer.begin_capture(15, EPOCH_NS + 10**9)
    writer.describe([BURST, GAP])
    writer.close()
    return tmp_path / "rec"


def test_annotations_and_captures_are_valid_sigmf(annotated):
    theirs = sigmf.fromfile(str(annotated) + ".sigmf-meta")
    theirs.validate()
    sigmf.validate.validate(metadata(annotated))
    gap, burst = theirs.get_annotations()
    assert (burst["core:sample_start"], burst["core:sample_count"]) == (20, 30)
    assert (burst["core:freq_lower_edge"], burst["core:freq_upper_edge"]) == BURST.edges_hz
    assert (burst["core:label"], burst["core:comment"]) == ("burst", "QPSK 1/2")
    assert gap["core:generator"] == burst["core:generator"] == "tests 1"
    assert "core:freq_lower_edge" not in gap
    assert theirs.get_global_field("core:hw") == "a radio"
    assert theirs.get_global_field("core:description") == "a test"
    first, second = theirs.get_captures()
    assert first["core:datetime"] == "2023-11-14T22:13:20.123456Z"
    assert (second["core:sample_start"], second["core:datetime"][17:19]) == (15, "21")
    assert second["core:frequency"] == TUNING.frequency_hz
    assert describe(annotated).n_samples == 100
    assert describe(annotated).gaps == ((5, 10),)


def test_a_recording_that_is_cut_off_reads(tmp_path):
    writer = RecordingWriter(tmp_path / "rec", "cf32_le", RATE, 0)
    writer.write(0, noise(40))
    assert len(read(tmp_path / "rec")) == 40
    sigmf.validate.validate(metadata(tmp_path / "rec"))
    assert metadata(tmp_path / "rec")["annotations"] == []
    assert len(writer.read(30, 20)) == 10
    assert (writer.read(0, 40) == noise(40)).all()
    writer.close()


def test_metadata_that_cannot_be_written_leave_those_there_were(tmp_path):
    path = tmp_path / "rec"
    writer = RecordingWriter(path, "ci8", RATE, 0)
    writer.describe([BURST])
    before = metadata(path)
    path.with_suffix(".sigmf-part").symlink_to("/dev/full")
    with pytest.raises(BackendError, match=r"rec.sigmf-meta: cannot be written \(No space left"):
        writer.describe([BURST, GAP])
    writer.close()
    assert metadata(path) == before
    assert not path.with_suffix(".sigmf-part").exists()
