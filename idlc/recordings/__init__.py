"""Recordings as a source of types and values: MCAP files, rosbag2's .db3 files, folders of either.

What is in a recording is read with the standard library, and PyYAML for the metadata of bags.
numpy, decompressors and pyarrow are imported when somebody asks for messages.
"""
