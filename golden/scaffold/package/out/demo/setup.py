"""Install demo: `colcon build` and `pip install` both run this file."""

from glob import glob
from importlib.util import find_spec
from runpy import run_path

from setuptools import find_packages, setup

package_name = 'demo'

if not find_spec('idlc'):  # this build stops if `idlc gen` was not run after a change
    run_path('demo/_idlc_build.py')

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
    maintainer="Ada's team",
    maintainer_email='ada@example.com',
    description='The package demo.',
    license='Apache-2.0',
    extras_require={'test': ['pytest']},
    entry_points={
        'console_scripts': [
            # 'command = demo.module:function',
        ],
    },
)
