"""The syntax of interface files, and of the IDL that ROS 2 makes from them."""
