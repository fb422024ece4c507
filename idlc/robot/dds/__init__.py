"""DDS, the default middleware of ROS 2, in Python: RTPS over UDP, and a transport over it."""
