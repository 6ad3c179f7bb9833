"""Sizes and limits of the blanker; see `phy.kernels.blanking`."""

import math

BLOCK = 64
"""Samples of a block. What is shorter than half of one, and stands out, is a pulse."""
WINDOW = 8 * BLOCK
"""While there are no pulses, such windows are looked at, each with two blocks of the last."""
LEVEL = 1 / math.log(2)
"""Mean power of noise, relative to the median of its samples' powers."""
LIMIT = 10 ** (11 / 10) / LEVEL
"""A sample with so many times the level of its block and of both neighbors stands out."""
WORTH = BLOCK / 2
"""A pulse is cut whose samples that stand out have more energy than so many at the level."""
REACH = 2
"""So many samples before and behind go, too: the edges of a pulse."""
DIP = 8
"""Samples that stand out are of one pulse if they are so close; what is between them goes, too."""
RISE = 1.5
"""Only blocks with so much more energy than the third quietest of eight are looked at closely."""
