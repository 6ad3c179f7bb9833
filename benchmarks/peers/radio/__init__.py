"""How others read a radio: with SoapySDR in a thread of their own process, and with GNU Radio.

`bare` measures both on the test radio; `flowgraph` runs with GNU Radio's interpreter.
"""
