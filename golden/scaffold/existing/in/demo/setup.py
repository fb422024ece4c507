from setuptools import find_packages, setup

package_name = 'demo'   # as in package.xml

setup(
    name=package_name,
    version='0.0.0',
    packages=find_packages(exclude=['test']),
    data_files=[
        ('share/ament_index/resource_index/packages',
            ['resource/' + package_name]),
        ('share/' + package_name, ['package.xml']),
    ],
    install_requires=['setuptools'],
    zip_safe=True,
    maintainer='user', maintainer_email='user@example.com',
    license='MIT',
    entry_points={
        'console_scripts': [
            'old_node = demo.old:main',   # keep this one
            # and this remark
        ],
    },
)
