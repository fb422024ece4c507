"""Actions: servers that execute goals, and clients that send them, in the words of rclpy."""
