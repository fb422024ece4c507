"""The user's package.xml, setup files, CMakeLists.txt and launch files: read and edited."""
