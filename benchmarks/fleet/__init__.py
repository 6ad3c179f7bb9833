"""Gateways over Zenoh, beside what their robots' daemons hear: `python -m benchmarks.fleet`."""
