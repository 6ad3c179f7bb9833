"""How the code is built: calls of one message, imports between rooms, writes to a message's fields.

`python -m benchmarks.structure` prints all of it; none of it depends on the machine.
"""

from benchmarks.structure.sources import deep_chains, graph, writes
from benchmarks.structure.trace import trace

__all__ = [
    "deep_chains",
    "graph",
    "trace",
    "writes",
]
