"""PMTs as GNU Radio writes them; any other bytes are refused."""

import contextlib
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.pdulink.testing import pmt
from tests.pdulink.gnu_radio import PYTHON, no_gnu_radio

GOLDEN = [
    (None, "06"),
    (True, "00"),
    (False, "01"),
    ("k", "0200016b"),
    (5, "0300000005"),
    (-1, "03ffffffff"),
    (1 << 40, "0d0000010000000000"),
    ((1 << 64) - 1, "0bffffffffffffffff"),
    (0.5, "043fe0000000000000"),
    (1 + 2j, "053ff00000000000004000000000000000"),
    (pmt.Pair({"k": 5}, b"\1\2\3"), "0709070200016b0300000005060a00000000030100010203"),
    ([1, "a"], "0800000002030000000102000161"),
    ((None,), "0c0000000106"),
    ({}, "06"),
    ({"a": 1, "b": 2}, "0907020001620300000002090702000161030000000106"),
]
"""Golden vectors from GNU Radio's pmt.serialize_str."""


@pytest.mark.parametrize(("value", "data"), GOLDEN, ids=str)
def test_bytes_are_those_of_gnu_radio(value, data):
    assert pmt.dumps(value).hex() == data
    read = pmt.loads(bytes.fromhex(data))
    assert read == (None if value == {} else value), "an empty dict is nil there, too"


@pytest.mark.parametrize(
    "kind", ["u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8", "f4", "f8", "c8", "c16"]
)
def test_uniform_vectors_come_back(kind):
    sent = np.arange(-3, 4).astype(kind)
    got = pmt.loads(pmt.dumps(sent))
    if kind == "u1":
        assert got == sent.tobytes()
    else:
        assert np.array_equal(got, sent)
        assert got.dtype.newbyteorder("=") == sent.dtype


plain = st.one_of(
    st.none(), st.booleans(), st.integers(-(1 << 63), (1 << 64) - 1), st.text(max_size=20),
    st.floats(allow_nan=False), st.complex_numbers(allow_nan=False), st.binary(max_size=40),
)  # fmt: skip
values = st.recursive(
    plain,
    lambda inner: st.one_of(
        st.builds(pmt.Pair, inner, inner),
        st.lists(inner, max_size=4),
        st.lists(inner, max_size=4).map(tuple),
        st.dictionaries(st.text(max_size=5), inner, min_size=1, max_size=4),
    ),
    max_leaves=12,
)


@given(values)
def test_what_is_written_is_read_again(value):
    assert pmt.loads(pmt.dumps(value)) == value


@given(st.binary(max_size=200))
def test_any_bytes_are_read_or_refused(data):
    with contextlib.suppress(ValueError):
        pmt.loads(data)


@given(values, st.data())
def test_damaged_ones_are_read_or_refused(value, data):
    whole = bytearray(pmt.dumps(value))
    at = data.draw(st.integers(0, len(whole) - 1))
    whole[at] = data.draw(st.integers(0, 255))
    for damaged in (bytes(whole), bytes(whole[:at])):
        with contextlib.suppress(ValueError):
            pmt.loads(damaged)


def test_what_is_no_pmt_is_refused():
    for value in (object(), 1 << 70, "x" * 70_000, np.zeros((2, 2)), {1, 2}):
        with pytest.raises(ValueError, match=r"no PMT|beyond|at most|no uniform"):
            pmt.dumps(value)
    with pytest.raises(ValueError, match="too deep"):
        pmt.loads(b"\x07" * 100)


THERE = """
import sys, pmt
for line in sys.stdin:
    value = pmt.deserialize_str(bytes.fromhex(line))
    print(pmt.serialize_str(value).hex())
"""


@pytest.mark.skipif(bool(no_gnu_radio()), reason=no_gnu_radio())
def test_gnu_radio_reads_ours_and_writes_the_same(tmp_path):
    rng = np.random.default_rng(3)
    sent = [pmt.dumps(value) for value, _ in GOLDEN]
    sent += [pmt.dumps(rng.integers(0, 99, 5).astype(kind)) for kind in ("u1", "i2", "f4", "c8")]
    lines = "".join(each.hex() + "\n" for each in sent)
    done = subprocess.run(
        [PYTHON, "-c", THERE], input=lines, capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == [each.hex() for each in sent]
    assert sys.executable != PYTHON
