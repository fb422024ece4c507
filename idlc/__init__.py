"""idlc: the ROS 2 interface compiler for Python."""

__version__ = "0.2.0"
