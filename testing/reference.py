# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Slow, obvious oracles, straight from the paper's equations; nothing of the core is used here.

Cameras, lenses, cost models and meshes are the core's plain records, read by attribute.
Distances are metres, normals point outward.
"""

from __future__ import annotations

import functools
import itertools
import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import Bounds, LinearConstraint, milp
from scipy.sparse import coo_array

# --- Optics (Sec. 4.2) ---------------------------------------------------------------------------


def depth_of_field(s, lens):
    """Return D_N(s) = H·s / (H + s − F) and D_F(s) = H·s / (H − s + F), inf beyond H + F."""
    h, f = lens.hyperfocal_distance, lens.focal_length
    near = h * s / (h + s - f)
    far = h * s / (h - s + f) if h - s + f > 0 else math.inf
    return near, far


def in_focus(depth, s, lens):
    """Return whether ``depth`` lies between the limits of focus distance s (Sec. 4.2)."""
    near, far = depth_of_field(s, lens)
    return near <= depth <= far


def settable(lens):
    """Return the distances of a lens that takes certain ones only, None if it takes a range."""
    if lens.focus_steps is not None:
        near, far = 1 / lens.min_focus, 1 / lens.max_focus
        dioptres = [
            near + (far - near) * i / (lens.focus_steps - 1) for i in range(lens.focus_steps)
        ]
        return sorted(1 / d for d in dioptres if d > 1e-12)
    if lens.table is not None and lens.table.settable_distances is not None:
        least, most = limits(lens)
        return [d for d in whole_distances(lens.table) if least <= d <= most]
    return None if lens.focus_distances is None else sorted(set(lens.focus_distances))


def limits(lens):
    """Return the nearest and farthest distance that the lens and its table have."""
    distances = lens.table.distances if lens.table is not None else ()
    return (
        max([lens.min_focus, *distances[:1]]),
        min([lens.max_focus, *distances[-1:]]),
    )


def device_value(table, distance):
    """Return the device value of a distance, not rounded: linear in dioptres between entries."""
    if not table.distances:
        return distance if table.unit == "m" else 1 / distance
    entries = list(zip(table.distances, table.values, strict=True))
    for (near, value_near), (far, value_far) in itertools.pairwise(entries):
        if near <= distance <= far:
            share = (1 / near - 1 / distance) / (1 / near - 1 / far)
            return value_near + share * (value_far - value_near)
    raise AssertionError(distance)


def whole_distances(table):
    """Return the finite distances of all whole device values, or every so many, ascending."""
    found = set()
    step = int(table.step) or 1
    taken = range(math.ceil(min(table.values)), math.floor(max(table.values)) + 1, step)
    entries = list(zip(table.distances, table.values, strict=True))
    for (near, value_near), (far, value_far) in itertools.pairwise(entries):
        low, high = sorted([value_near, value_far])
        for value in taken:
            if not low <= value <= high:
                continue
            share = (value - value_near) / (value_far - value_near)
            dioptres = 1 / near + share * (1 / far - 1 / near)
            if value == value_near:
                found.add(near)
            elif value == value_far:
                found.add(far)
            else:
                found.add(1 / dioptres)
    return sorted(found - {math.inf})


def holds(depth, s, lens, tolerance):
    """Return whether all depths from depth − tolerance to depth + tolerance are in focus at s."""
    ends = depth - tolerance, depth + tolerance
    return ends[0] > lens.focal_length and all(in_focus(end, s, lens) for end in ends)


# --- Cameras -------------------------------------------------------------------------------------


def camera_axes(camera):
    """Return the camera's x, y and z axis in the world: e → q·e·q* with q = (x, y, z, w)."""
    return _turned_axes(tuple(camera.orientation))


@functools.cache
def _turned_axes(quaternion):
    qx, qy, qz, qw = quaternion

    def turn(v):
        # Rodrigues: v + 2w (u × v) + 2 u × (u × v), with u the quaternion's vector.
        u = np.array([qx, qy, qz])
        cross = np.cross(u, v)
        return v + 2 * qw * cross + 2 * np.cross(u, cross)

    return tuple(turn(axis) for axis in np.eye(3))


def in_image(camera, point):
    """Return the projection (u, v) and whether it falls on a pixel that is read out."""
    x_axis, y_axis, z_axis = camera_axes(camera)
    offset = np.asarray(point) - np.asarray(camera.position)
    z = float(offset @ z_axis)
    if z <= 0:
        return math.nan, math.nan, False
    intrinsics = camera.intrinsics
    x, y = float(offset @ x_axis) / z, float(offset @ y_axis) / z
    u, v = pixels(intrinsics, x, y)
    return u, v, bool(is_read(intrinsics, u, v)) and grows(intrinsics, math.hypot(x, y))


def coefficients(intrinsics):
    """Return k₁..k₆, p₁, p₂, s₁..s₄ of a polynomial model by name, the missing ones 0."""
    names = ["k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4"]
    return dict.fromkeys(names, 0.0) | dict(zip(names, intrinsics.distortion, strict=False))


def distorted(intrinsics, x, y):
    """Return where (x, y, 1) is imaged, in focal lengths, as OpenCV's manual writes it; arrays too.

    Its sections on the camera model of calib3d and on that of fisheye cameras.
    """
    r = np.hypot(x, y)
    if intrinsics.distortion_model == "equidistant":
        k1, k2, k3, k4 = intrinsics.distortion
        a = np.arctan(r)
        theta_d = a * (1 + k1 * a**2 + k2 * a**4 + k3 * a**6 + k4 * a**8)
        share = np.where(r > 0, theta_d / np.where(r > 0, r, 1.0), 1.0)
        return share * x, share * y
    c = coefficients(intrinsics)
    share = (1 + c["k1"] * r**2 + c["k2"] * r**4 + c["k3"] * r**6) / (
        1 + c["k4"] * r**2 + c["k5"] * r**4 + c["k6"] * r**6
    )
    p1, p2 = c["p1"], c["p2"]
    return (
        share * x + 2 * p1 * x * y + p2 * (r**2 + 2 * x**2) + c["s1"] * r**2 + c["s2"] * r**4,
        share * y + p1 * (r**2 + 2 * y**2) + 2 * p2 * x * y + c["s3"] * r**2 + c["s4"] * r**4,
    )


def pixels(intrinsics, x, y):
    """Return the pixel coordinates of the image of (x, y, 1); arrays too."""
    x, y = distorted(intrinsics, x, y) if intrinsics.distortion_model else (x, y)
    return intrinsics.fx * x + intrinsics.cx, intrinsics.fy * y + intrinsics.cy


def grows(intrinsics, tangent, steps=2000):
    """Return whether the image grows all the way from the axis to this tan θ, step by step.

    The polynomials' radial part by more than other terms may take back at the most.
    """
    if not intrinsics.distortion_model:
        return True
    r = np.linspace(0.0, tangent, steps + 1)
    if intrinsics.distortion_model == "equidistant":
        a = np.linspace(0.0, math.atan(tangent), steps + 1)
        grown, _ = distorted(intrinsics, np.tan(a), 0 * a)
        return bool((np.diff(grown) > 0).all())
    c = coefficients(intrinsics)
    if (1 + c["k4"] * r**2 + c["k5"] * r**4 + c["k6"] * r**6 <= 0).any():
        return False
    grown = r * (1 + c["k1"] * r**2 + c["k2"] * r**4 + c["k3"] * r**6)
    grown = grown / (1 + c["k4"] * r**2 + c["k5"] * r**4 + c["k6"] * r**6)
    square = 3 * math.hypot(c["p1"], c["p2"]) + math.hypot(c["s1"], c["s3"])
    taken_back = square * r**2 + math.hypot(c["s2"], c["s4"]) * r**4
    return bool((np.diff(grown - taken_back) > 0).all())


def is_read(intrinsics, u, v):
    """Return whether pixel coordinates lie in a whole bin of the region of interest; arrays too.

    Pixel centres have whole coordinates: column 0 reaches from -0.5 to 0.5.
    """
    left, top, width, height = intrinsics.region or (0, 0, intrinsics.width, intrinsics.height)
    columns, rows = intrinsics.binning
    column = np.floor((np.floor(u + 0.5) - left) / columns)
    row = np.floor((np.floor(v + 0.5) - top) / rows)
    return (column >= 0) & (column < width // columns) & (row >= 0) & (row < height // rows)


def metres_per_pixel(camera, point, normal, step=1e-6):
    """Return how far one goes along the surface per pixel of the picture, where that is farthest.

    By going a short way from the point in many directions on its tangent plane, forth and back,
    then in as many about the best of them.
    """
    x_axis, y_axis, z_axis = camera_axes(camera)
    offset = np.asarray(point) - np.asarray(camera.position)
    any_other = np.eye(3)[np.argmin(np.abs(normal))]
    first = np.cross(normal, any_other) / np.linalg.norm(np.cross(normal, any_other))
    second = np.cross(normal, first) / np.linalg.norm(np.cross(normal, first))
    columns, rows = camera.intrinsics.binning
    best, reach = 0.0, np.pi / 2
    for _ in range(3):
        angle = best + np.linspace(-reach, reach, 401)[:, None]
        way = step * np.linalg.norm(offset) * (np.cos(angle) * first + np.sin(angle) * second)
        ends = []
        for at in (offset - way, offset + way):
            depth = at @ z_axis
            u, v = pixels(camera.intrinsics, at @ x_axis / depth, at @ y_axis / depth)
            ends.append(np.array([u / columns, v / rows]))
        lengths = 2 * np.linalg.norm(way, axis=1) / np.hypot(*(ends[1] - ends[0]))
        best, reach = float(angle[np.argmax(lengths), 0]), reach / 100
    return float(lengths.max())


# --- Visibility ----------------------------------------------------------------------------------


def occluded(mesh, origin, target, stop_short, margin=0.0):
    """Return whether any triangle stands between origin and target (Möller–Trumbore).

    Hits in the last ``stop_short`` metres before the target do not count. ``margin`` widens the
    triangles, in barycentric coordinates; a negative one shrinks them.
    """
    direction = target - origin
    length = math.sqrt(direction @ direction)
    a, b, c = (mesh.vertices[mesh.triangles[:, i]] for i in range(3))
    edge_1, edge_2 = b - a, c - a
    p = np.cross(direction, edge_2)
    determinant = (edge_1 * p).sum(axis=1)
    parallel = np.abs(determinant) < 1e-15
    inverse = 1 / np.where(parallel, 1.0, determinant)
    offset = origin - a
    u = (offset * p).sum(axis=1) * inverse
    q = np.cross(offset, edge_1)
    v = (q @ direction) * inverse
    t = (edge_2 * q).sum(axis=1) * inverse
    hit = (u >= -margin) & (v >= -margin) & (u + v <= 1 + margin)
    return bool((hit & ~parallel & (t > 0) & (t * length < length - stop_short)).any())


def sees(mesh, camera, point, normal, stop_short, margin=0.0):
    """Return whether the camera sees the point: in the image, from outside, with a clear view."""
    position = np.array(camera.position)
    _, _, inside = in_image(camera, point)
    depth = float((point - position) @ camera_axes(camera)[2])
    return (
        inside
        and depth > camera.lens.focal_length
        and float((point - position) @ normal) < 0
        and not occluded(mesh, position, point, stop_short, margin)
    )


# --- Cost (Sec. 3.2) -----------------------------------------------------------------------------


def pointwise_cost(point, normal, camera, s, model):
    """Return κ_s^c(p) of a point that the camera sees (Eq. 1)."""
    p, n_c = np.asarray(point), camera_axes(camera)[2]
    n_p = -np.asarray(normal)  # the paper's point inward
    offset = p - np.asarray(camera.position)
    depth = float(offset @ n_c)
    incidence = float(n_c @ n_p)
    # Off the axis a camera may see a surface that is turned away from the axis: no pixels at all.
    area = model.projected_area_scale * depth**2 / incidence if incidence > 0 else math.inf
    deviation = math.sqrt(((offset - depth * n_c) ** 2).sum()) / model.axis_deviation_limit
    return (
        model.projected_area_weight * min(area, 1)
        + model.axis_deviation_weight * min(deviation, 1)
        + model.focus_weight * (1 - in_focus(depth, s, camera.lens))
    )


def total_cost(points, normals, weights, rig, visible, focus, model):
    """Return 1000 × the weighted mean of min over cameras of κ (Eq. 2), unseen points costing 1.

    ``visible`` is the set of (sample, camera) that are seen.
    """
    total = 0.0
    for p in range(len(points)):
        costs = [
            pointwise_cost(points[p], normals[p], camera, focus[c], model)
            for c, camera in enumerate(rig.cameras)
            if (p, c) in visible
        ]
        total += weights[p] * min(costs, default=1.0)
    return 1000 * total / sum(weights)


# --- The discrete problem ------------------------------------------------------------------------


@dataclass(frozen=True)
class Seen:
    """One camera's sight of one sample: its cost in focus, and the distances that focus it."""

    base: float
    near: float
    far: float

    def cost(self, s, focus_weight):
        return self.base + (0.0 if self.near <= s <= self.far else focus_weight)


@dataclass(frozen=True)
class Table:
    """A discrete problem as a list of dictionaries: sample → camera → Seen."""

    seen: list
    weights: list
    focus_weight: float
    cameras: int
    views: int = 1
    shots: int = 1

    def share(self, p):
        """Return what sample p adds to the cost per unit of pointwise cost."""
        return 1000 * self.weights[p] / sum(self.weights)

    def of_camera(self, c):
        return {p: cameras[c] for p, cameras in enumerate(self.seen) if c in cameras}


def table(problem):
    """Return the table of a ``Problem``."""
    seen = [{} for _ in range(len(problem.samples.weights))]
    for q in range(len(problem.depth)):
        seen[problem.sample_index[q]][int(problem.camera_index[q])] = Seen(
            float(problem.base_cost[q]), float(problem.focus_near[q]), float(problem.focus_far[q])
        )
    weights = [float(weight) for weight in problem.samples.weights]
    return Table(
        seen, weights, problem.focus_weight, len(problem.names), problem.views, problem.shots
    )


def cost(table, focus):
    """Return the total cost at these focus distances (Eq. 2): the mean over the cheapest views."""
    return cost_as_assigned(table, focus, assign_views(table, focus))


def cost_as_assigned(table, focus, phi):
    """Return the total cost where each sample has its views in these cameras, a list each."""
    total = 0.0
    for p, cameras in enumerate(table.seen):
        costs = [cameras[c].cost(focus[c], table.focus_weight) for c in phi[p]]
        total += table.share(p) * (sum(costs) + table.views - len(costs)) / table.views
    return total


def assign_views(table, focus):
    """Return each sample's cheapest cameras, no two of them shots of one, cheapest first."""
    return [
        _cheapest(table, focus, cameras.items(), table.views, frozenset()) for cameras in table.seen
    ]


def _cheapest(table, focus, cameras, count, taken):
    """Return the cheapest of these cameras; those of views that are taken are no choice."""
    costs = {c: seen.cost(focus[c], table.focus_weight) for c, seen in cameras}
    chosen, taken = [], set(taken)
    for c in sorted(costs, key=lambda c: (costs[c], c)):
        if len(chosen) < count and c // table.shots not in taken:
            chosen.append(c)
            taken.add(c // table.shots)
    return chosen


def assign(table, focus):
    """Return φ, each sample's cheapest camera, the first of equal ones, None if unseen (Eq. 5)."""
    phi = []
    for cameras in table.seen:
        costs = {c: seen.cost(focus[c], table.focus_weight) for c, seen in cameras.items()}
        phi.append(min(costs, key=lambda c: (costs[c], c)) if costs else None)
    return phi


def candidates(intervals):
    """Return every focus distance worth trying: interval ends, and the middles between them."""
    ends = sorted({end for near, far in intervals if near <= far for end in (near, far)})
    finite = [end for end in ends if end < math.inf]
    middles = [(a + b) / 2 for a, b in itertools.pairwise(finite)]
    beyond = [2 * finite[-1]] if finite else []
    return finite + middles + beyond


def camera_candidates(table, c):
    """Return the focus distances worth trying for camera c, one for each set they hold in focus."""
    seen = table.of_camera(c)
    by_set = {}
    for s in candidates([(sight.near, sight.far) for sight in seen.values()]):
        held = frozenset(p for p in seen if seen[p].near <= s <= seen[p].far)
        by_set.setdefault(held, s)
    return list(by_set.values())


def stab(table, c, phi, present):
    """Return camera c's best focus distance for its own samples by trying them all (Eq. 8).

    Its own are those p with c in the list phi[p]. Of equal distances the one that holds most of all
    that the camera sees, and the present one before all others.
    """
    seen = table.of_camera(c)

    def held(s):
        inside = [p for p in seen if seen[p].near <= s <= seen[p].far]
        own = sum(table.weights[p] for p in inside if c in phi[p])
        return own, sum(table.weights[p] for p in inside)

    best, best_held = present, held(present)
    for s in camera_candidates(table, c):
        if _exceeds(held(s), best_held):
            best, best_held = s, held(s)
    return best


def _exceeds(new, old):
    """Compare tuples of sums in order, sums within rounding being equal."""
    for a, b in zip(new, old, strict=True):
        if abs(a - b) > 1e-12:
            return a > b
    return False


def em(table, focus):
    """Return the costs of EM's iterations and its last focus distances (Sec. 3.3)."""
    focus, costs = list(focus), []
    while True:
        phi = assign_views(table, focus)
        moved = [stab(table, c, phi, focus[c]) for c in range(table.cameras)]
        costs.append(cost(table, moved))
        if moved == focus:
            return costs, focus
        focus = moved


def best_step(table, focus, members, scope):
    """Return the least cost that moving ``members`` alone reaches, and the distances for it.

    Every combination of candidate distances is tried (Sec. 3.4). With scope "all" each sample
    goes to its cheapest camera, and the cost is the total. With "assigned" the samples assigned
    to the members stay among them, and all others keep their camera: its cost is that of the
    assignment, not of the cheapest camera.
    """
    trials = [camera_candidates(table, c) if c in members else [s] for c, s in enumerate(focus)]
    if not all(trials):
        return math.inf, None
    if scope == "all":
        best = _cheapest_combination(table, trials)
        return cost(table, best), best
    phi = assign_views(table, focus)
    kept = [[c for c in cameras if c not in members] for cameras in phi]
    to_hand_over = [len(cameras) - len(own) for cameras, own in zip(phi, kept, strict=True)]
    best = _cheapest_combination(table, trials, members, kept, to_hand_over)
    return assigned_cost(table, best, phi, members), best


def _cheapest_combination(table, trials, members=None, kept=None, count=None):
    """Return the distances, one of each camera's trials, at which the total is least.

    Sample p has count[p] views, all that it needs by default, in the cheapest of the members, by
    default of all cameras; but none in another shot of a camera that it is kept by. What it has in
    those cameras is the same for all combinations.
    """
    samples = len(table.seen)
    count = [table.views] * samples if count is None else count
    taken = [{c // table.shots for c in own} for own in kept or [[]] * samples]
    costs = [np.full((len(distances), samples), np.inf) for distances in trials]
    for c in range(table.cameras) if members is None else members:
        for p, seen in table.of_camera(c).items():
            if c // table.shots not in taken[p]:
                costs[c][:, p] = [seen.cost(s, table.focus_weight) for s in trials[c]]
    share = np.array([table.share(p) for p in range(samples)])
    views = -(-table.cameras // table.shots)
    needed = np.arange(views)[:, None, None] < np.array(count)
    combinations = np.array(list(itertools.product(*(range(len(each)) for each in trials))))
    best, least = None, math.inf
    for some in np.array_split(combinations, 1 + len(combinations) // 4096):
        of_view = np.full((views, len(some), samples), np.inf)
        for c, chosen in enumerate(some.T):
            np.minimum(of_view[c // table.shots], costs[c][chosen], out=of_view[c // table.shots])
        of_view.sort(axis=0)
        of_view[np.isinf(of_view)] = 1.0
        totals = (share * of_view.sum(axis=0, where=needed)).sum(axis=-1)
        if totals.min() < least:
            best, least = some[totals.argmin()], totals.min()
    return [distances[i] for distances, i in zip(trials, best, strict=True)]


def assigned_cost(table, focus, phi, members):
    """Return the cost where the views that the members have go to the cheapest of them (Sec. 3.4).

    A sample keeps its views in other cameras, and has none in another shot of these.
    """
    handed_over = []
    for p, cameras in enumerate(table.seen):
        kept = [c for c in phi[p] if c not in members]
        choice = [(c, seen) for c, seen in cameras.items() if c in members]
        taken = {c // table.shots for c in kept}
        theirs = _cheapest(table, focus, choice, len(phi[p]) - len(kept), taken)
        handed_over.append(kept + theirs)
    return cost_as_assigned(table, focus, handed_over)


def optimum_by_enumeration(table):
    """Return the least total cost by trying every combination of candidate distances (Eq. 3)."""
    trials = [camera_candidates(table, c) or [1.0] for c in range(table.cameras)]
    return cost(table, _cheapest_combination(table, trials))


def bracket_optimum(problem, shots, tolerance):
    """Return the least total cost of so many shots per camera, by trying all sets of distances.

    From the depths and lenses of a one-shot ``Problem`` alone: what is in focus is told by the
    depth of field, not by intervals.
    """
    sighted = [{} for _ in problem.names]
    for q, c in enumerate(problem.camera_index):
        sighted[c][int(problem.sample_index[q])] = problem.depth[q], problem.base_cost[q]
    weights, w_3 = problem.samples.weights, problem.focus_weight
    best = math.inf
    for held in itertools.product(
        *(
            _bracket_sets(seen, lens, shots, tolerance)
            for seen, lens in zip(sighted, problem.lenses, strict=True)
        )
    ):
        total = 0.0
        for p, weight in enumerate(weights):
            costs = [
                seen[p][1] + w_3 * (p not in sharp)
                for seen, sharp in zip(sighted, held, strict=True)
                if p in seen
            ]
            total += weight * min(costs, default=1.0)
        best = min(best, total)
    return 1000 * best / weights.sum()


def _bracket_sets(seen, lens, shots, tolerance):
    """Return the sets of samples that so many distances of one camera hold in focus."""
    single = {
        frozenset(p for p, (depth, _) in seen.items() if holds(depth, s, lens, tolerance))
        for s in settable(lens) or _between_changes(seen, lens, tolerance)
    }
    unions = {
        frozenset().union(*some) for some in itertools.combinations_with_replacement(single, shots)
    }
    return [held for held in unions if not any(held < other for other in unions)]


def _between_changes(seen, lens, tolerance):
    """Return a distance between every two at which something comes into or goes out of focus."""
    h, f = lens.hyperfocal_distance, lens.focal_length
    least, most = limits(lens)
    changes = {max(least, 1.001 * f), min(most, 1e4)}
    for depth, _ in seen.values():
        far, near = depth + tolerance, depth - tolerance
        changes.add(far * (h + f) / (h + far))
        if f < near < h:
            changes.add(near * (h - f) / (h - near))
    allowed = sorted(s for s in changes if least <= s <= most)
    return [(a + b) / 2 for a, b in itertools.pairwise(allowed)]


class _Program:
    """A mixed-integer program under construction; variables lie between 0 and 1."""

    def __init__(self):
        self.objective, self.integral = [], []
        self.rows, self.columns, self.values, self.upper = [], [], [], []

    def variable(self, coefficient, *, whole):
        self.objective.append(coefficient)
        self.integral.append(int(whole))
        return len(self.objective) - 1

    def at_most(self, limit, terms):
        """Require the sum of value · variable over the terms to be at most ``limit``."""
        for column, value in terms:
            self.rows.append(len(self.upper))
            self.columns.append(column)
            self.values.append(value)
        self.upper.append(limit)

    def arrays(self):
        """Return the program as the arguments of SciPy's ``milp``."""
        shape = len(self.upper), len(self.objective)
        matrix = coo_array((self.values, (self.rows, self.columns)), shape=shape).tocsr()
        return {
            "c": np.array(self.objective),
            "integrality": np.array(self.integral),
            "bounds": Bounds(0, 1),
            "constraints": LinearConstraint(matrix, -np.inf, self.upper),
        }


def optimum(table):
    """Return the least total cost and a lower bound, by mixed-integer programming (HiGHS)."""
    program, constant = facility_location(table)
    result = milp(**program.arrays(), options={"mip_rel_gap": 0.0})
    assert result.success, result.message
    return constant + result.fun, constant + result.mip_dual_bound


def facility_location(table):
    """Return the mixed-integer program of the least total cost, and what to add to its objective.

    x chooses one distance per camera, y the camera that images a sample in focus, which needs a
    chosen distance that holds it. What remains, a sample out of focus in the camera with the least
    base cost, is a constant.
    """
    program, holders = _Program(), {}
    for c in range(table.cameras):
        choices = [(program.variable(0.0, whole=True), held) for held in _largest_sets(table, c)]
        program.at_most(1.0, [(x, 1.0) for x, _ in choices])
        for x, held in choices:
            for p in held:
                holders.setdefault((p, c), []).append(x)
    constant = 0.0
    for p, cameras in enumerate(table.seen):
        out = min((seen.base for seen in cameras.values()), default=1.0 - table.focus_weight)
        out += table.focus_weight
        constant += table.share(p) * out
        sharp = []
        for c, seen in cameras.items():
            if seen.base < out and (p, c) in holders:
                y = program.variable(-table.share(p) * (out - seen.base), whole=False)
                sharp.append(y)
                program.at_most(0.0, [(y, 1.0), *((x, -1.0) for x in holders[p, c])])
        program.at_most(1.0, [(y, 1.0) for y in sharp])
    return program, constant


def _largest_sets(table, c):
    """Return the sets of samples that one distance of camera c holds in focus.

    What a distance holds is part of what the nearest interval start below it holds, so starts
    are enough; and one whose set the next one's contains is not needed.
    """
    seen = table.of_camera(c)
    starts = sorted({sight.near for sight in seen.values() if sight.near <= sight.far})
    sets = [frozenset(p for p in seen if seen[p].near <= s <= seen[p].far) for s in starts]
    return [
        held
        for held, following in itertools.zip_longest(sets, sets[1:], fillvalue=frozenset())
        if not held <= following
    ]


# --- Bounds --------------------------------------------------------------------------------------


def focus_gains(table):
    """Return the cost with every camera out of focus, and sample by sample camera → gain of focus.

    Weighted; cameras that gain nothing, or that focus on the sample nowhere, are left out.
    """
    total, gains = 0.0, []
    for p, cameras in enumerate(table.seen):
        least = min((seen.base for seen in cameras.values()), default=1.0 - table.focus_weight)
        out = least + table.focus_weight
        total += table.share(p) * out
        gains.append(
            {
                c: table.share(p) * (out - seen.base)
                for c, seen in cameras.items()
                if seen.near <= seen.far and seen.base < out
            }
        )
    return total, gains


def price_bound(table, prices):
    """Return D(v) = Σ v_p + Σ_c max_s Σ_{p held by c at s} (g_pc − v_p)⁺ by trying every s."""
    _, gains = focus_gains(table)
    total = sum(prices)
    for c in range(table.cameras):
        seen = table.of_camera(c)
        takings = [
            sum(
                max(gains[p].get(c, 0.0) - prices[p], 0.0)
                for p in seen
                if seen[p].near <= s <= seen[p].far
            )
            for s in camera_candidates(table, c)
        ]
        total += max(takings, default=0.0)
    return total


def cells_gain(gains, cell):
    """Return what a choice of cells gains: per sample the largest gain that is held in focus."""
    largest = [0] * len(gains.most)
    for c in range(len(cell)):
        for j in range(gains.offsets[c], gains.offsets[c + 1]):
            if gains.first[j] <= cell[c] <= gains.last[j]:
                largest[gains.sample[j]] = max(largest[gains.sample[j]], int(gains.gain[j]))
    return sum(largest)


def cells_between(low, high):
    """Yield every choice of cells from low to high; -1 for a camera without cells."""
    return itertools.product(
        *(range(a, b + 1) if a <= b else [-1] for a, b in zip(low, high, strict=True))
    )


def all_cells(gains):
    """Return the least and the last cell of each camera, 0 and -1 for one without."""
    counts = np.diff(gains.cell_offsets)
    return np.zeros(len(counts), dtype=np.int32), (counts - 1).astype(np.int32)


def largest_gain(gains, low=None, high=None):
    """Return the most that any choice of cells gains, by trying them all.

    It is the largest ``cells_gain``, of all choices at once: an axis for each camera, and the
    samples.
    """
    if low is None:
        low, high = all_cells(gains)
    largest = np.zeros(len(gains.most), dtype=np.int64)
    for c in range(len(low)):
        held = np.zeros((max(high[c] - low[c] + 1, 1), len(gains.most)), dtype=np.int64)
        for j in range(gains.offsets[c], gains.offsets[c + 1]):
            for cell in range(max(gains.first[j], low[c]), min(gains.last[j], high[c]) + 1):
                here = cell - low[c], gains.sample[j]
                held[here] = max(held[here], int(gains.gain[j]))
        largest = np.maximum(largest[..., None, :], held)
    return int(largest.sum(axis=-1).max())


def takings(gains, c, cell, price):
    """Return what a cell of camera c takes above the prices."""
    return sum(
        max(int(gains.gain[j]) - int(price[gains.sample[j]]), 0)
        for j in range(gains.offsets[c], gains.offsets[c + 1])
        if gains.first[j] <= cell <= gains.last[j]
    )


def confined_bound(gains, price, low=None, high=None):
    """Return D(v) in units where camera c is confined to its cells low[c] to high[c]."""
    if low is None:
        low, high = all_cells(gains)
    total = sum(int(v) for v in price)
    for c in range(len(low)):
        cells = range(low[c], high[c] + 1)
        total += max((takings(gains, c, i, price) for i in cells), default=0)
    return total


def cut_members(cuts, k):
    """Return a cut's limit, its pairs, and its ranges: camera, first and last cell."""
    pairs = [int(j) for j in cuts.pair[cuts.pair_offsets[k] : cuts.pair_offsets[k + 1]]]
    part = slice(cuts.range_offsets[k], cuts.range_offsets[k + 1])
    columns = (cuts.camera[part], cuts.first[part], cuts.last[part])
    return int(cuts.limit[k]), pairs, [tuple(map(int, row)) for row in zip(*columns, strict=True)]


def cut_bound(gains, cuts, price, multiplier, low=None, high=None):
    """Return D(v, λ) in units where camera c is confined to its cells low[c] to high[c]."""
    if low is None:
        low, high = all_cells(gains)
    members = [(cut_members(cuts, k), int(weight)) for k, weight in enumerate(multiplier)]
    total = sum(int(v) for v in price) + sum(limit * weight for (limit, _, _), weight in members)
    taken = [int(gain) - int(price[p]) for gain, p in zip(gains.gain, gains.sample, strict=True)]
    for (_, pairs, _), weight in members:
        for j in pairs:
            taken[j] -= weight
    for c in range(len(low)):
        own = range(gains.offsets[c], gains.offsets[c + 1])
        total += max(
            (
                sum(max(taken[j], 0) for j in own if gains.first[j] <= cell <= gains.last[j])
                + sum(
                    weight
                    for (_, _, ranges), weight in members
                    for camera, first, last in ranges
                    if camera == c and first <= cell <= last
                )
                for cell in range(low[c], high[c] + 1)
            ),
            default=0,
        )
    return total


def cut_excess(gains, cuts, k, cell):
    """Return by how much the best assignment at these cells violates a cut: above 0 if it does."""
    limit, pairs, ranges = cut_members(cuts, k)
    camera = np.repeat(np.arange(len(cell)), np.diff(gains.offsets))
    most = {}
    for j in set(pairs):
        if gains.first[j] <= cell[camera[j]] <= gains.last[j]:
            p = int(gains.sample[j])
            most[p] = max(most.get(p, 0), pairs.count(j))
    standing = sum(first <= cell[c] <= last for c, first, last in ranges)
    return sum(most.values()) - limit - standing


# --- Kernels -------------------------------------------------------------------------------------


def best_pair(gain_a, gain_b, rectangles, weights):
    """Return the most of gain_a[i] + gain_b[j] − Σ weights of rectangles around (i, j)."""
    value = np.add.outer(np.asarray(gain_a, dtype=np.int64), np.asarray(gain_b, dtype=np.int64))
    i, j = np.indices(value.shape)
    for (i_0, i_1, j_0, j_1), weight in zip(rectangles, weights, strict=True):
        value[(i_0 <= i) & (i <= i_1) & (j_0 <= j) & (j <= j_1)] -= int(weight)
    return int(value.max())
