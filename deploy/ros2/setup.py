"""Installs the launch file and the RViz configuration where ``ros2 launch`` finds them."""

from glob import glob

from setuptools import setup

NAME = "onemap_bringup"

setup(
    name=NAME,
    version="0.3.0",
    packages=[NAME],
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/launch", glob("launch/*.launch.py")),
        (f"share/{NAME}/rviz", glob("rviz/*.rviz")),
    ],
    zip_safe=True,
    maintainer="The OneMap authors",
    maintainer_email="onemap@example.com",
    description="Starts OneMap, which needs no ROS 2 itself, and RViz with its topics.",
    license="Apache-2.0",
)
