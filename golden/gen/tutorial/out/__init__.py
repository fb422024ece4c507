"""The interfaces of tutorial_msgs."""
