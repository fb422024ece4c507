"""The interfaces of comments_msgs."""
