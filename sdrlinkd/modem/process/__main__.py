"""Entry of `python -m sdrlinkd.modem.process CONTROL PAGE`.

ModemProcess runs it. The two arguments are numbers of inherited descriptors.
"""

import os
import sys

from sdrlinkd.modem.process.main import main

if __name__ == "__main__":
    main()
    # A driver may leave threads that never end.
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(0)
