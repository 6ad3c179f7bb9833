"""The range of frequency offsets in the burst search follows the radios' crystals."""

import pytest

from sdrlinkd.config import ModemParams, cfo_told, cfo_warning, make_setup, parse_config
from tests.conftest import ETC

SOAPY = 'backend = "soapy"\n[soapy]\ndevice = "driver=x"\n[modem]\n'


@pytest.mark.parametrize(
    ("frequency_hz", "rate_hz", "ppm", "searched_hz"),
    [
        (2.45e9, 5e6, 40, 196e3),
        (5.9e9, 5e6, 40, 472e3),
        (433e6, 1e6, 20, 17.32e3),
        # No farther than a receiver can search.
        (5.9e9, 1e6, 40, 250e3),
        (2.45e9, 1e4, 40, 2500),
        (2.45e9, 1e6, 0, 0),
    ],
)
def test_both_crystals_may_be_off(frequency_hz, rate_hz, ppm, searched_hz):
    modem = ModemParams(frequency_hz=frequency_hz, rate_hz=rate_hz, crystal_ppm=ppm)
    assert modem.searched_cfo_hz == pytest.approx(searched_hz)


def test_without_a_frequency_that_of_the_simulation_counts():
    assert ModemParams().searched_cfo_hz == pytest.approx(2 * 40e-6 * 2.45e9)


def test_check_says_how_far_off_bursts_are_looked_for():
    summary = make_setup(parse_config(f"{SOAPY}frequency_hz = 5.9e9"), ETC).summary()
    assert (
        "the receiver searches for bursts up to 472 kHz off: two crystals of ±40 ppm "
        "(modem.crystal_ppm) at 5900 MHz can be 472 kHz apart"
    ) in summary
    assert not any("kHz" in line for line in make_setup(parse_config(""), ETC).summary())


def test_what_cannot_be_reached_is_warned_of_with_what_to_do():
    setup = make_setup(parse_config(f"{SOAPY}frequency_hz = 5.9e9\nrate_hz = 1e6"), ETC)
    (warning,) = [each for each in setup.warnings if "apart" in each]
    assert "up to 250 kHz off" in warning
    assert "can be 472 kHz apart; radios farther apart do not hear each other" in warning
    assert "raise modem.rate_hz, or state better crystals (modem.crystal_ppm)" in warning
    setup = make_setup(parse_config(f"{SOAPY}frequency_hz = 5.9e9\nmax_cfo_hz = 1e5"), ETC)
    (warning,) = [each for each in setup.warnings if "apart" in each]
    assert "raise modem.max_cfo_hz" in warning


def test_a_slow_simulation_is_not_warned_of():
    assert cfo_warning(ModemParams(rate_hz=1e4)) == ""
    assert "2.5 kHz off" in cfo_told(ModemParams(rate_hz=1e4))


def test_what_is_given_counts():
    modem = ModemParams(max_cfo_hz=5e4)
    assert modem.searched_cfo_hz == 5e4
    assert cfo_told(modem) == "the receiver searches for bursts up to 50 kHz off (modem.max_cfo_hz)"
