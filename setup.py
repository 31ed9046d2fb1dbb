# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Build focus_planner, for pip and for colcon (ament_python)."""

from pathlib import Path

from setuptools import find_packages, setup

NAME = "focus_planner"
# Where there are wheels of ROS, and of Open3D at a fraction of its size.
ON_LINUX_X86 = "sys_platform == 'linux' and platform_machine == 'x86_64'"

setup(
    name=NAME,
    version="0.2.0",
    description="Plans the focus distances of a multi-camera capture rig",
    # colcon build --symlink-install runs a link to this file, elsewhere.
    long_description=Path(__file__).resolve().with_name("README.md").read_text(encoding="utf-8"),
    long_description_content_type="text/markdown",
    author="focus_planner developers",
    license="Apache-2.0",
    keywords=[
        "camera",
        "coverage",
        "depth of field",
        "focus",
        "multi-view",
        "photogrammetry",
        "robotics",
        "ROS 2",
    ],
    classifiers=[
        "Development Status :: 4 - Beta",
        "Environment :: Console",
        "Intended Audience :: Manufacturing",
        "Intended Audience :: Science/Research",
        "Operating System :: MacOS",
        "Operating System :: Microsoft :: Windows",
        "Operating System :: POSIX :: Linux",
        "Programming Language :: Python :: 3 :: Only",
        "Programming Language :: Python :: 3.10",
        "Programming Language :: Python :: 3.11",
        "Programming Language :: Python :: 3.12",
        "Programming Language :: Python :: 3.13",
        "Topic :: Multimedia :: Graphics :: Capture :: Digital Camera",
        "Topic :: Scientific/Engineering",
        "Typing :: Typed",
    ],
    python_requires=">=3.10",
    packages=find_packages(include=[NAME, f"{NAME}.*"]),
    package_data={
        NAME: ["bodies/*", "messages/definitions/*/*", "report/bundle/*", "py.typed"],
    },
    data_files=[
        # The marker by which ROS finds the package, and its manifest.
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (
            f"share/{NAME}/config",
            [
                "config/focus_planner.rviz",
                "config/focus_planner.yaml",
                "config/foxglove_layout.json",
                "config/lens_adapter.yaml",
                "config/simulated_lens.yaml",
            ],
        ),
        (f"share/{NAME}/launch", ["launch/focus_planner.launch.xml"]),
        (
            f"share/{NAME}/security",
            ["security/loopback.xml", "security/loopback_udp.xml", "security/policies.xml"],
        ),
    ],
    # Each floor is the oldest release in requirements.lock for any Python: nothing older is tested.
    install_requires=[
        "argcomplete>=3.7",
        "lz4>=4.4",
        "embreex>=4.4; sys_platform != 'linux' or platform_machine == 'x86_64'",
        "mapbox-earcut>=2.1",
        "mcap>=1.6",
        "numba>=0.68",
        "numpy>=2.2",
        "open3d>=0.20; sys_platform != 'linux' or platform_machine != 'x86_64'",
        f"open3d-cpu>=0.20; {ON_LINUX_X86}",
        "pillow>=12.3",
        "pyyaml>=6.0",
        "rich>=15.0",
        "rosbags>=0.11",
        "scipy>=1.15",
        "zstandard>=0.25",
    ],
    extras_require={
        # The paper's experiments on many subjects and machines.
        "evaluation": ["distributed>=2026.8", "matplotlib>=3.10", "pandas>=2.3"],
        # Compressed glTF, the files of laser scanners, and maps as EXR.
        "formats": [
            "dracopy>=2.2",
            "laspy>=2.7",
            "lazrs>=0.8",
            "openexr>=3.5",
            "pye57>=0.4; platform_machine != 'aarch64'",  # no wheel
        ],
        "pdf": ["reportlab>=5.1"],
        "picture": ["matplotlib>=3.10", "pillow>=12.3"],
        # For machines without ROS. The interfaces, focus_planner_msgs, are not on any index: they
        # are built from msg_defs, as `make setup` does.
        "ros": [
            f"ros-jazzy-common-interfaces>=5.3,<5.4; {ON_LINUX_X86}",
            f"ros-jazzy-rclpy[fastrtps]>=7.1,<7.2; {ON_LINUX_X86}",
        ],
        # By pytest in it colcon knows what to run.
        "test": [
            "hypothesis>=6.168",
            "mcap-ros2-support>=0.6",
            "opencv-python-headless>=5.0",
            "pytest>=9.2",
            "pytest-timeout>=2.4",
            "pytest-xdist>=3.8",
            "trimesh>=5.2",
        ],
    },
    entry_points={
        "console_scripts": [
            "focus_planner = focus_planner.cli.main:main",
            "planner_node = focus_planner.cli.executables:planner_node",
            "lens_adapter = focus_planner.cli.executables:lens_adapter",
            "simulated_lens = focus_planner.cli.executables:simulated_lens",
        ],
    },
    zip_safe=False,
)
