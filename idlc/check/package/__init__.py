"""Rules on the package of interfaces: package.xml, setup.py, CMakeLists.txt."""
