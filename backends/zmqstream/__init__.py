"""Complex samples over ZeroMQ, as GNU Radio's gr-zeromq and srsRAN's radio exchange them."""

from backends.zmqstream.endpoint import open_endpoint
from backends.zmqstream.radio import ZmqRadio

__all__ = ["ZmqRadio", "open_endpoint"]
