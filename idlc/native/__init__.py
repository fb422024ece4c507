"""The type support library that C++ tools of ROS 2 load, written without a compiler.

`library.libraries` makes it. Nothing here reads or writes a file.
"""
