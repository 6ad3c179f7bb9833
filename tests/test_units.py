"""Times and sizes as people write them."""

import pytest

from sdrlinkd.errors import UserError
from sdrlinkd.units import octets, seconds


@pytest.mark.parametrize(
    ("text", "value"),
    [("0.1", 0.1), ("100ms", 0.1), ("2 s", 2), ("50us", 5e-5), ("1min", 60), ("inf", float("inf"))],
)
def test_times(text, value):
    assert seconds(text, "key") == pytest.approx(value)


@pytest.mark.parametrize(
    ("text", "value"), [("64000", 64000), ("64k", 64000), ("1MiB", 1 << 20), ("1.5KB", 1500)]
)
def test_sizes(text, value):
    assert octets(text, "key") == value


@pytest.mark.parametrize("text", ["", "fast", "1parsec", "-1", "1 2", "1e", "nan"])
def test_what_is_neither_is_refused(text):
    for read in (seconds, octets):
        with pytest.raises(UserError, match="--key: got"):
            read(text, "--key")
    with pytest.raises(UserError):
        octets("inf", "--key")
