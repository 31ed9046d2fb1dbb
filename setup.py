"""Build focus_planner, for pip and for colcon (ament_python)."""

from setuptools import find_packages, setup

NAME = "focus_planner"

setup(
    name=NAME,
    version="0.1.0",
    description="Plans the focus distances of a multi-camera capture rig",
    license="Apache-2.0",
    python_requires=">=3.10",
    packages=find_packages(include=[NAME, f"{NAME}.*"]),
    package_data={NAME: ["bodies/*", "messages/definitions/*/*", "py.typed"]},
    data_files=[
        # The marker by which ROS finds the package, and its manifest.
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/config", ["config/focus_planner.yaml"]),
        (f"share/{NAME}/launch", ["launch/focus_planner.launch.xml"]),
        (f"share/{NAME}/security", ["security/loopback.xml", "security/policies.xml"]),
    ],
    # rclpy and the messages are not listed: without ROS all but focus_planner.ros works.
    install_requires=[
        "argcomplete",
        "matplotlib",
        "mcap",
        "numba",
        "numpy",
        "open3d-cpu",
        "pyyaml",
        "rich",
        "rosbags",
        "scipy",
        "trimesh",
    ],
    entry_points={
        "console_scripts": [
            "focus_planner = focus_planner.cli.main:main",
            "planner_node = focus_planner.ros.node:main",
            "lens_adapter = focus_planner.ros.lens_adapter:main",
            "simulated_lens = focus_planner.ros.simulated_lens:main",
        ],
    },
    zip_safe=False,
)
