"""The interfaces of lyrical_msgs."""
