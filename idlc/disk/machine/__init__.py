"""What this machine has: ROS 2 and its prefixes, importable packages, the graph that runs."""
