"""Install demo: `colcon build` and `pip install` both come here."""

from glob import glob
import sys

from setuptools import find_packages, setup

package_name = 'demo'
index = ['resource/' + package_name]  # ROS 2 finds the package by it
interfaces = glob('resource/rosidl_interfaces/*')

try:
    from idlc.build import compile_interfaces
except ImportError:
    compiled = {}  # what was compiled last is installed, without libraries for C++ tools
    if glob('msg/*.msg') or glob('srv/*.srv') or glob('action/*.action'):
        index = interfaces = []  # `ros2 bag record` would stop at it
        print(package_name + ' is not registered with ROS 2: idlc is missing', file=sys.stderr)
else:
    compiled = compile_interfaces(package_name)

setup(
    **compiled,
    name=package_name,
    version='0.1.0',
    packages=find_packages(exclude=['test']),
    package_data={'': ['idlc.lock', 'py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', index),
        ('share/ament_index/resource_index/rosidl_interfaces', interfaces),
        ('share/' + package_name, ['package.xml']),
        ('share/' + package_name + '/launch', glob('launch/*launch.*')),
        ('share/' + package_name + '/msg', glob('msg/*.msg')),
        ('share/' + package_name + '/srv', glob('srv/*.srv')),
        ('share/' + package_name + '/action', glob('action/*.action')),
    ],
    install_requires=['numpy', 'setuptools'],
    zip_safe=False,
    maintainer='Your Name',
    maintainer_email='you@example.com',
    description='The package demo.',
    license='Apache-2.0',
    extras_require={'test': ['pytest']},
    entry_points={
        'console_scripts': [
            # 'command = demo.module:function',
            'talker = demo.talker:main',
            'oracle = demo.oracle:main',
            'asker = demo.asker:main',
            'station = demo.station:main',
            'ship = demo.ship:main',
            'both = demo.both:main',
        ],
    },
)
