"""LSA, ROUTE and BARE, against octets that were written out by hand."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sdrlinkd.wire import (
    Bare,
    Lsa,
    Need,
    Route,
    bare,
    build_records,
    loss_of,
    lsa_digest,
    parse_records,
    share_of,
)
from tests.laws import law
from tests.wire.route_vectors import (
    BARE_IN,
    BARE_NUMBERS,
    BARE_WIDE_NUMBERS,
    DIGESTED,
    LOSSES,
    NEWER,
    ROUTE_RECORDS,
)

KINDS = {"LSA": Lsa, "ROUTE": Route, "NEED": Need, "BARE": Bare}


@pytest.mark.parametrize("vector", ROUTE_RECORDS, ids=lambda vector: vector.name)
def test_records(vector):
    records = [KINDS[kind](*fields) for kind, fields in vector.records]
    assert parse_records(vector.payload) == records
    assert build_records(records) == vector.payload


def test_an_odd_octet_is_ignored():
    assert parse_records(bytes([13, 4, 9, 0, 1, 7])) == [Lsa(9, 1, ())]


def test_the_digest_stands_for_all():
    digest = next(each for each in ROUTE_RECORDS if each.name == "lsa_digest")
    assert build_records([lsa_digest(dict(reversed(DIGESTED)))]) == digest.payload


@pytest.mark.parametrize(("share", "loss"), LOSSES)
def test_losses(share, loss):
    assert loss_of(share) == loss
    if loss < 255:
        assert loss_of(share_of(loss)) == loss


@pytest.mark.parametrize(("number", "last", "is_newer"), NEWER)
def test_newer(number, last, is_newer):
    assert Lsa(1, number).is_newer(last) == is_newer


@pytest.mark.parametrize("numbers", [BARE_NUMBERS, BARE_WIDE_NUMBERS])
def test_bare(numbers):
    made = bare(numbers, BARE_IN)
    assert made.numbers(BARE_IN) == list(numbers)
    assert build_records([made]) in {each.payload for each in ROUTE_RECORDS}


@law()
@given(st.sets(st.integers(0, 1000), min_size=1), st.integers(0, 1000), st.integers(0, 20))
def test_bare_pdus_are_named_as_far_as_it_reaches(numbers, number, later):
    """A PDU that is made anew has a number that is a little higher."""
    made = bare(numbers, number)
    near = sorted(each for each in numbers if 0 < number - each <= 96)
    assert ([] if made is None else made.numbers(number + later)) == near


@law()
@given(st.integers(0, 255), st.binary(min_size=1, max_size=16), st.integers(0, 1 << 32))
def test_no_bare_record_names_its_own_pdu_or_later_ones(seq, bitmap, number):
    assert all(each < number for each in Bare(seq, bitmap).numbers(number))
