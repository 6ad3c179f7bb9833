"""Entry of `python -m backends.soapy.radio_process CONTROL RX RX_MEMORY TX_MEMORY`.

SoapyRadio runs it. The four arguments are numbers of inherited descriptors.
"""

import os
import sys

from backends.soapy.radio_process import main

if __name__ == "__main__":
    main()
    # Drivers may leave threads that never end.
    sys.stdout.flush()
    os._exit(0)
