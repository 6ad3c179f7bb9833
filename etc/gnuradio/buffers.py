"""Import before GNU Radio: room for a whole burst between its blocks, which a PHY's need.

Asked for block by block, as set_min_output_buffer does, it does not reach chunks_to_symbols.
"""

import os

# Half the bytes of a buffer; the longest burst, of 2047 bytes in BPSK, has 28 000 complex samples.
os.environ.setdefault("GR_CONF_DEFAULT_BUFFER_SIZE", str(1 << 18))
