"""The interfaces of layouts_msgs."""
