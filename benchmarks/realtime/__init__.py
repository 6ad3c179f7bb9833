"""Whole daemons in real time: latency, age, load and start, each in turns with another checkout."""
