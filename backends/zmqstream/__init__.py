"""Complex samples over ZeroMQ, as GNU Radio's gr-zeromq and srsRAN's radio speak them."""

from backends.zmqstream.radio import ZmqRadio

__all__ = ["ZmqRadio"]
