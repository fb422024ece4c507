"""Nodes and interfaces of my_robot_controller."""
