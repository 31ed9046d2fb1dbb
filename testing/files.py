"""Files of every kind that a name can lead to, good, damaged and absurd; and who reads them.

Damage is drawn from a generator that the caller seeds. Some of it happens to leave a good file.
"""

from __future__ import annotations

import json
import math
import re
import struct
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from focus_planner.core.planning.plan_focus import plan_focus
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.scene import Scene
from focus_planner.core.surface.surface import PointCloud
from focus_planner.core.validation import InputError
from focus_planner.io.camera_info import load_camera_info
from focus_planner.io.colmap import load_alignment, load_colmap
from focus_planner.io.importance import load_importance
from focus_planner.io.lens_tables import load_lens_tables
from focus_planner.io.plans import load_plan, plan_to_json
from focus_planner.io.rigs import load_rig, rig_to_yaml
from focus_planner.io.surfaces import load_surface
from focus_planner.io.transforms import load_transforms
from testing.malformed import BALL, CLOUD, RIG
from testing.plans import a_plan

