"""Edits of setup.py, launch files and package.xml that keep every other byte."""
