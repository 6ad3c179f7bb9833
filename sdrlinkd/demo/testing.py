"""What tests look at, piece by piece; not part of the interface."""

from sdrlinkd.demo import run
from sdrlinkd.demo.load import LoadOf
from sdrlinkd.demo.rate import Tried, tried_out
from sdrlinkd.demo.report import PhyResult, run_result, topic_results
from sdrlinkd.demo.trace import goodput_bytes_per_s, path_error_m

__all__ = [
    "WRITE_CONFIG",
    "LoadOf",
    "PhyResult",
    "Tried",
    "goodput_bytes_per_s",
    "path_error_m",
    "run_result",
    "topic_results",
    "tried_out",
]

WRITE_CONFIG = (run, "write_config")
"""Where a run finds `write_config`, which tests replace."""
