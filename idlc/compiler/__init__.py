"""From texts to checked models: the passes, and the verdicts of ROS 2."""
