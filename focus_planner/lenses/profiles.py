# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""How the driver nodes of cameras take a focus distance, and what they say of the lens.

What is written here of a driver is from its source: camera_ros 0.4 to 0.7, libcamera's Raspberry Pi
pipeline, tier4's ros2_v4l2_camera, usb_cam 0.8 and the jazzy branch of depthai-ros, 2.10.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from focus_planner.core.rig.lens_table import DIOPTRES, METRES

DEVICE = "device"
UNITS = (METRES, DIOPTRES, DEVICE)
CUSTOM = "custom"
#: What stands for a camera's name, and for its lens on the driver node, in names.
CAMERA, LENS = "{camera}", "{lens}"

#: A parameter's value.
Value = bool | int | float | str
Assignment = tuple[str, Value]


@dataclass(frozen=True)
class DriverProfile:
    """How a driver node takes a focus distance.

    Attributes
    ----------
    parameter : str
        The parameter that moves the lens.
    unit : str
        ``"m"``, ``"dioptres"``, or ``"device"`` for a unit that needs a lens table.
    whole : bool
        Whether it is an integer parameter.
    first : tuple of (str, value)
        What is set before it, to end autofocus, as far as the driver has these parameters.
    together : bool
        Whether all of them are set in one call, in this order; else one by one.
    measures : bool
        Whether the parameter reads back where the lens is, and not what it was set to.
    frames : bool
        Whether the driver publishes the metadata of every frame, the lens's position among them,
        as camera_ros does.
    node : str
        The driver node's usual name, in which ``{camera}`` stands for the camera's.
    lens : str
        What ``{lens}`` in names of parameters usually stands for.
    """

    parameter: str
    unit: str
    whole: bool
    first: tuple[Assignment, ...] = ()
    together: bool = True
    measures: bool = False
    frames: bool = False
    node: str = f"{CAMERA}/camera"
    lens: str = CAMERA

    def of(self, camera: str, lens: str = "") -> DriverProfile:
        """Return the profile with the names of the parameters of one camera's lens.

        Parameters
        ----------
        camera : str
        lens : str
            What the driver calls the lens; "" for the usual.
        """

        def named(pattern: str) -> str:
            return pattern.replace(LENS, lens or self.lens).replace(CAMERA, camera)

        first = tuple((named(name), value) for name, value in self.first)
        return replace(self, parameter=named(self.parameter), first=first)


PROFILES: Mapping[str, DriverProfile] = {
    # A parameter of the same name for each libcamera control. libcamera takes LensPosition in
    # dioptres, and ignores it unless AfMode is AfModeManual, 0. What is set takes effect with the
    # next frame, and only the last call before it does: one call, or AfMode is lost.
    "camera_ros": DriverProfile(
        "LensPosition", DIOPTRES, False, (("AfMode", 0),), frames=True, node=f"{CAMERA}/camera"
    ),
    # Parameters are called after V4L2 controls: "Focus, Absolute" is focus_absolute. It cannot be
    # set during autofocus, which newer kernels call "Focus, Automatic Continuous" and older ones
    # "Focus, Auto". Controls are set one after the other in the order of the call.
    "v4l2_camera": DriverProfile(
        "focus_absolute",
        DEVICE,
        True,
        (("focus_automatic_continuous", False), ("focus_auto", False)),
        node=f"{CAMERA}/v4l2_camera",
    ),
    # Takes all parameters of a call, then runs v4l2-ctl for each control and ignores its failures.
    "usb_cam": DriverProfile(
        "focus", DEVICE, True, (("autofocus", False),), node=f"{CAMERA}/usb_cam"
    ),
    # Looks at the values before the call: a position in the call that ends autofocus is ignored.
    "depthai": DriverProfile(
        f"{LENS}.r_focus",
        DEVICE,
        True,
        ((f"{LENS}.r_set_man_focus", True),),
        together=False,
        node=f"{CAMERA}/oak",
        lens="rgb",
    ),
}
DRIVERS = (*PROFILES, CUSTOM)
