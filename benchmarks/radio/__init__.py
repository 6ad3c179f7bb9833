"""Daemons on radios by SoapySDR, in real time, on the test radio of tests/soapy_loopback."""
