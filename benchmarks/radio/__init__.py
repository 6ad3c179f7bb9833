"""Daemons on radios through SoapySDR, in real time, on the test radio of tests/soapy_loopback."""
