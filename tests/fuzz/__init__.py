"""Coverage-guided fuzzing of everything that reads what others wrote.

    make fuzz SECONDS=600            # each target in turn, for so long
    python -m tests.fuzz 60 pdu link # two of them

Each target has a stored corpus, which `python -m tests.fuzz.corpus` makes, and a mutator that knows
the format: it keeps checksums, lengths and types true half of the time, so that inputs get past the
first check. An input that raises anything but the errors that the reader promises is a crash, and
is kept in `build/fuzz`.
"""

import sys
from pathlib import Path

# The ROS 2 package is no part of the environment.
sys.path.insert(0, str(Path(__file__).parents[2] / "ros" / "sdrlink_ros"))
