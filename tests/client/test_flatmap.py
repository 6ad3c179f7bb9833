"""The client's MessagePack against a real one."""

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sdrlinkd.client import pack_map, unpack

plain = (
    st.none() | st.booleans() | st.integers(-(2**63), 2**64 - 1) | st.floats(allow_nan=False)
    | st.text(max_size=300) | st.binary(max_size=300)
)  # fmt: skip
nested = st.recursive(
    plain,
    lambda inner: (
        st.lists(inner, max_size=20) | st.dictionaries(st.text(max_size=40), inner, max_size=20)
    ),
)


@settings(derandomize=True, deadline=None, max_examples=300)
@given(st.dictionaries(st.text(max_size=40), plain, max_size=15))
def test_what_it_packs_others_read(values):
    assert msgspec.msgpack.decode(pack_map(values)) == values
    assert unpack(pack_map(values)) == values


@settings(derandomize=True, deadline=None, max_examples=150)
@given(nested)
def test_what_others_pack_it_reads(value):
    assert unpack(msgspec.msgpack.encode(value)) == value


@settings(derandomize=True, deadline=None, max_examples=2000)
@given(st.binary(max_size=60))
def test_any_bytes_are_a_value_or_refused(data):
    try:
        unpack(data)
    except ValueError:
        return


@pytest.mark.parametrize(
    "data",
    [
        b"\xdd\xff\xff\xff\xff",
        b"\xdf\xff\xff\xff\xff\x01",
        b"\xc6\xff\xff\xff\xff",
        b"\x91" * 10_000,
    ],
)
def test_huge_claims_are_refused_at_once(data):
    with pytest.raises(ValueError, match="MessagePack"):
        unpack(data)


def test_too_many_fields():
    with pytest.raises(ValueError, match="15"):
        pack_map({str(i): i for i in range(16)})
