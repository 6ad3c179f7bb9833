"""Import before GNU Radio: makes room for a whole burst between blocks, as a PHY needs it.

Setting the size per block with set_min_output_buffer does not reach chunks_to_symbols.
"""

import os

# The setting is half of a buffer in bytes; the longest burst, 2047 bytes in BPSK, has 28 000
# complex samples.
os.environ.setdefault("GR_CONF_DEFAULT_BUFFER_SIZE", str(1 << 18))
