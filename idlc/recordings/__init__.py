"""Recordings as a source of types and values: MCAP files and rosbag2's bags."""
