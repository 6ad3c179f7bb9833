"""The client's MessagePack against a real one."""

import tracemalloc

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.client import pack_map, unpack
from tests.laws import law

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


@pytest.mark.slow
@law(300)
@given(st.dictionaries(st.text(max_size=40), plain, max_size=15))
def test_what_it_packs_others_read(values):
    assert msgspec.msgpack.decode(pack_map(values)) == values
    assert unpack(pack_map(values)) == values


@pytest.mark.slow
@law(150)
@given(nested)
def test_what_others_pack_it_reads(value):
    assert unpack(msgspec.msgpack.encode(value)) == value


@law(2000)
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


@pytest.mark.parametrize("head", [b"\xdd", b"\xdf"])
def test_a_huge_claim_costs_no_more_than_the_bytes_there_are(head):
    tracemalloc.start()
    with pytest.raises(ValueError, match="MessagePack"):
        unpack(head + b"\xff\xff\xff\xff" + b"\xc0" * 10_000)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 1_000_000


@pytest.mark.slow
@law(150)
@given(nested, st.data())
def test_a_cut_value_is_refused(value, data):
    whole = msgspec.msgpack.encode(value)
    with pytest.raises(ValueError):
        unpack(whole[: data.draw(st.integers(0, len(whole) - 1))])


def test_more_than_one_value_is_refused():
    with pytest.raises(ValueError, match="1 bytes after"):
        unpack(b"\x01\x02")


@pytest.mark.parametrize(
    "value",
    [0, 127, 128, 255, 256, 65535, 65536, 2**32 - 1, 2**32, 2**63, 2**64 - 1, -1, -32, -33, -128,
     -129, -32769, -(2**31) - 1, -(2**63), "é" * 16, "a" * 31, "a" * 32, "a" * 65535, b"",
     b"a" * 65535, float("inf"), True, False, None],
)  # fmt: skip
def test_values_at_the_edges(value):
    packed = pack_map({"k": value})
    assert msgspec.msgpack.decode(packed) == unpack(packed) == {"k": value}
    assert type(unpack(packed)["k"]) is type(value)
    assert unpack(msgspec.msgpack.encode(value)) == value


@pytest.mark.parametrize("value", [2**64, -(2**63) - 1, "a" * 65536, b"a" * 65536])
def test_what_does_not_fit_is_refused_in_words(value):
    with pytest.raises(ValueError):
        pack_map({"k": value})


def test_too_many_fields():
    with pytest.raises(ValueError, match="15"):
        pack_map({str(i): i for i in range(16)})
