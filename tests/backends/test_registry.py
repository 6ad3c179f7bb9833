"""The table of radios: every row is complete, and costs nothing before it is used."""

import subprocess
import sys

import msgspec
import pytest

from backends import BUILT_IN, BackendError, Capabilities, ModemNeeds, Patience, RadioRequest
from backends import find_backend as find
from sdrlinkd.config import Config
from tests.backends.cases import RADIOS
from tests.backends.radios import AIR

NEEDS = ModemNeeds(rate_hz=2e6, oversampling=1, frequency_hz=433e6, block_s=0.001)
every_row = pytest.mark.parametrize("name", BUILT_IN)


def test_every_radio_of_the_table_is_under_contract():
    assert {case.backend for case in RADIOS} == set(BUILT_IN)


@every_row
def test_every_row_has_its_section(name):
    assert find(name).name == name
    assert type(getattr(Config(), name)) is find(name).settings


@every_row
async def test_every_row_makes_a_radio(name):
    row = find(name)
    request = RadioRequest(NEEDS, 1, 0.1, Patience.NONE, lambda: AIR, 1)
    radio = row.radio(row.settings(), request)
    for member in ("open", "blocks", "send", "close"):
        assert callable(getattr(radio, member))
    await radio.close()


@every_row
def test_every_row_answers_what_is_asked_without_a_radio(name):
    row = find(name)
    settings = row.settings()
    assert isinstance(row.problem(settings, NEEDS), str)
    assert all(isinstance(each, str) for each in row.unchecked(settings))
    for turnaround_s in (None, 0.01):
        presumed = row.presume(settings, NEEDS, turnaround_s)
        assert isinstance(presumed.capabilities, Capabilities)
    assert set(row.files) <= set(row.settings.__struct_fields__)


@every_row
def test_what_is_presumed_of_the_shared_air_is_so(name):
    """Whether others hear a radio depends on its kind, not on its settings."""
    row = find(name)
    presumed = row.presume(row.settings(), NEEDS, None).capabilities
    assert presumed.shares_air == (name not in ("loopback", "iqfile"))


def test_a_row_whose_code_is_missing_says_so():
    row = find("loopback")._replace(make="backends.nowhere:make")
    request = RadioRequest(NEEDS, 1, 0.1, Patience.NONE, lambda: AIR, 1)
    with pytest.raises(BackendError, match=r'got "loopback", whose code .* backends\.nowhere'):
        row.radio(row.settings(), request)


def test_an_unknown_name_is_told_with_those_known():
    with pytest.raises(BackendError) as caught:
        find("hackrf")
    listed = ", ".join(f'"{name}"' for name in BUILT_IN)
    assert str(caught.value) == f'backend: got "hackrf"; allowed: one of {listed}'


@pytest.mark.slow
def test_the_table_loads_no_radio():
    heavy = "numba", "phy", "SoapySDR", "backends.ether", "backends.loopback", "importlib.metadata"
    code = f"import sys, backends; print(*[each for each in {heavy} if each in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


def test_settings_can_go_to_another_process():
    for row in BUILT_IN.values():
        settings = row.settings()
        assert msgspec.json.decode(msgspec.json.encode(settings), type=row.settings) == settings
