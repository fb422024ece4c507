"""Programs of rclpy, run without it: `python -m idlc.robot my_node.py`."""
