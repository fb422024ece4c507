"""The interfaces of names_msgs."""
