"""Install my_robot_controller: `colcon build` and `pip install` both run this file."""

from glob import glob
from importlib.util import find_spec
from runpy import run_path

from setuptools import find_packages, setup

package_name = 'my_robot_controller'

if not find_spec('idlc'):  # this build stops if `idlc gen` was not run after a change
    run_path('my_robot_controller/_idlc_build.py')

setup(
    name=package_name,
    version='0.1.0',
    packages=find_packages(exclude=['test']),
    package_data={'': ['idlc.lock', 'py.typed']},
    data_files=[
        ('share/ament_index/resource_index/packages', ['resource/' + package_name]),
        (
            'share/ament_index/resource_index/rosidl_interfaces',
            glob('resource/rosidl_interfaces/*'),
        ),
        ('share/' + package_name, ['package.xml']),
        ('share/' + package_name + '/launch', glob('launch/*launch.*')),
        ('share/' + package_name + '/msg', glob('msg/*.msg')),
        ('share/' + package_name + '/srv', glob('srv/*.srv')),
        ('share/' + package_name + '/action', glob('action/*.action')),
    ],
    idlc_interfaces=True,  # where idlc is installed, compile msg/, srv/ and action/
    install_requires=['numpy', 'setuptools'],
    zip_safe=False,
    maintainer='The idlc authors',
    maintainer_email='maintainer@example.com',
    description='The package my_robot_controller.',
    license='Apache-2.0',
    extras_require={'test': ['pytest']},
    entry_points={
        'console_scripts': [
            # 'command = my_robot_controller.module:function',
            'sensor_publisher = my_robot_controller.sensor_publisher:main',
            'sensor_subscriber = my_robot_controller.sensor_subscriber:main',
            'command_publisher = my_robot_controller.command_publisher:main',
            'add_two_ints_server = my_robot_controller.add_two_ints_server:main',
            'add_two_ints_client = my_robot_controller.add_two_ints_client:main',
            'countdown_action_server = my_robot_controller.countdown_action_server:main',
            'countdown_action_client = my_robot_controller.countdown_action_client:main',
            'execute_task_server = my_robot_controller.execute_task_server:main',
            'execute_task_client = my_robot_controller.execute_task_client:main',
        ],
    },
)
