"""Times, sizes, frequencies and rates in user notation."""

import pytest

from sdrlinkd.errors import UserError
from sdrlinkd.units import bits_per_second, hertz, metres_per_second, octets, seconds


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


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("433.92e6", 433.92e6),
        ("433.92 MHz", 433.92e6),
        ("2Msps", 2e6),
        ("2.4ghz", 2.4e9),
        ("1.", 1),
    ],
)
def test_frequencies_and_rates(text, value):
    assert hertz(text, "key") == pytest.approx(value)


@pytest.mark.parametrize(("text", "value"), [("1e5", 1e5), ("100 kbit/s", 1e5), ("1.5Mbps", 1.5e6)])
def test_bit_rates(text, value):
    assert bits_per_second(text, "key") == pytest.approx(value)


@pytest.mark.parametrize(
    ("text", "value"), [("5", 5), ("5 m/s", 5), ("18km/h", 5), ("10kn", 5.144)]
)
def test_speeds(text, value):
    assert metres_per_second(text, "key") == pytest.approx(value, rel=1e-3)


@pytest.mark.parametrize("text", ["", "fast", "1parsec", "-1", "1 2", "1e", "nan"])
def test_what_is_neither_is_refused(text):
    for read in (seconds, octets, hertz, bits_per_second, metres_per_second):
        with pytest.raises(UserError, match="--key: got"):
            read(text, "--key")
    for read in (octets, hertz, bits_per_second, metres_per_second):
        with pytest.raises(UserError):
            read("inf", "--key")
