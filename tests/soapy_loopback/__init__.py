"""A SoapySDR radio for tests whose antenna is shared memory; README.md says what it can do."""

from tests.soapy_loopback.build import build, missing, module_folder
from tests.soapy_loopback.bus import Bus, Stats

__all__ = ["Bus", "Stats", "build", "missing", "module_folder"]
