"""The type support libraries that C++ tools of ROS 2 load, written without a compiler."""
