"""`python -m tests.soapy_loopback OUT`: the driver's module, for SOAPY_SDR_PLUGIN_PATH."""

import sys
from pathlib import Path

from tests.soapy_loopback.build import build

print(build(Path(sys.argv[1])))  # noqa: T201
