"""How others read a radio: by SoapySDR in a thread of their own process, and in a GNU Radio graph.

`bare` measures both on the test radio; `flowgraph` runs by the interpreter of GNU Radio.
"""
