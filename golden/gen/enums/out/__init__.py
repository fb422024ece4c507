"""The interfaces of enums_msgs."""
