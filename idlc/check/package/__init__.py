"""Rules on what surrounds interfaces: package.xml, setup.py, CMakeLists.txt."""
