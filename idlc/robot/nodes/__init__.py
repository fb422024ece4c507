"""Nodes without ROS, with the words of rclpy; `idlc.robot` exports their names."""
