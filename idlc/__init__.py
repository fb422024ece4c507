"""idlc: the ROS 2 interface compiler for Python."""

__version__ = "0.1.0"
