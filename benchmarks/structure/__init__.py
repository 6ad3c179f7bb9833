"""How the code is built: calls of one message, imports between rooms, writes to a message's fields.

`python -m benchmarks.structure` prints all of it; none of it depends on the machine.
"""
