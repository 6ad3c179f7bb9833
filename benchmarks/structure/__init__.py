"""Code structure: calls per message, imports between packages, writes to a message's fields.

`python -m benchmarks.structure` prints everything; none of it depends on the machine.
"""

from benchmarks.structure.sources import deep_chains, graph, writes
from benchmarks.structure.trace import trace

__all__ = [
    "deep_chains",
    "graph",
    "trace",
    "writes",
]
