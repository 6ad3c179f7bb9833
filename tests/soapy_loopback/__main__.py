"""`python -m tests.soapy_loopback [OUT]`: builds the driver's module, for SOAPY_SDR_PLUGIN_PATH.

Without OUT, it is in a folder of its own, and compiled once per version of the source.
"""

import sys
from pathlib import Path

from tests.soapy_loopback.build import build, missing, module_folder

if reason := missing():
    sys.exit(reason)
print(build(Path(sys.argv[1])) if sys.argv[1:] else module_folder())  # noqa: T201
