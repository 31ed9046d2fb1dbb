# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Branch and bound on prices: closes the gap that the relaxation leaves (docs/algorithm.md).

A node confines cameras to parts of their cells. It branches on a camera whose best cell, over the
last price steps, alternated between cells with a valley between them, and cuts it there in two. A
child inherits its parent's prices; only those near the cut camera need to adapt, which makes a
node cost a tenth of a bound from nothing. Reduced costs cut off the cells at either end of each
range that no better plan can use. The node with the highest bound goes first.

The camera to branch on is chosen by strong branching: the one whose two halves lower the bound
most, by the geometric mean. Children inherit what was measured, since fractional solutions are
local, and rank the candidates by it; cameras not yet measured rank by how often and how deeply they
alternated. With this, and steps that aim beyond the goal, a hundred nodes close a body with 8,192
samples to 1e-4, where three thousand had not.

With several views per sample a price is free only if every camera that takes the sample is near, so
more cameras are; and where a view takes several shots its cells are ascending, which leaves one
order of the same cells, and all prices adapt.

Also tried on bodies: HiGHS on the problem that reduced costs leave, slower at every size; and a
bound whose blocks are pairs of cameras, solved exactly by the sweep of ``kernels/pairs.py``, which
closed a quarter of the gap at most.
"""

from __future__ import annotations

import heapq
import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from focus_planner.core import kernels
from focus_planner.core.arrays import FloatArray, IntArray, Offsets
from focus_planner.core.problem.gains import Gains

# Only prices around the cameras that overlap most with the branched one adapt, so many for each
# view that a sample needs; every few generations all do.
_NEAR = 20
_WIDE_EVERY = 4
#: Pairs that gain less than the price by more than 2^-3 of the sample's largest gain are inactive.
REACH = 3
#: The most price steps of a node.
STEPS = 90
# How many cameras to try at the root and at other nodes, unless one lowers the bound by nearly as
# much as is expected of the next; and the least share of the slack credited to a half.
_ROOT_TRIES, _TRIES = 24, 4
_ENOUGH = 0.8
_LEAST = 1e-3
# Work on one batch of nodes, in pairs times steps: some 20 ms.
_WORK = 20_000_000
_OPEN_BYTES = 1_000_000_000


@dataclass(order=True)
class Node:
    """An open node; its arrays are a row each of :class:`kernels.Nodes`. Highest bound first.

    ``worth`` (C,) is by how much branching on a camera lowered the bound when it was last tried,
    at this node or an ancestor; NaN where it was not.
    """

    negative_bound: int
    number: int
    depth: int = field(compare=False)
    low: IntArray = field(compare=False)
    high: IntArray = field(compare=False)
    price: Offsets = field(compare=False)
    score: Offsets = field(compare=False)
    split: IntArray = field(compare=False)
    cell: IntArray = field(compare=False)
    worth: FloatArray = field(compare=False)


class Part(NamedTuple):
    """A part of a node: one camera, -1 for none, confined to cells ``first`` to ``last``."""

    node: Node
    camera: int
    first: int
    last: int


class Branching:
    """A search in progress: its open nodes, and how to branch on them.

    Parameters
    ----------
    gains : Gains
    price : (N,) array of int64
    bound : int
        What these prices prove, exactly; units.
    goal : int
        Units; nodes that cannot gain more are dropped.

    Attributes
    ----------
    nodes : int
        How many were bounded so far.
    leaf : (C,) array of int32, or None
        The cells of a plan, once a node has no other.
    """

    def __init__(self, gains: Gains, price: Offsets, bound: int, goal: int) -> None:
        self.nodes = 0
        self._gains = gains
        self._near = _overlapping(gains, price[: len(gains.most)], _NEAR * gains.views)
        self._by_sample = kernels.GainsBySample(
            np.empty(len(gains.most) + 1, dtype=np.int64),
            np.empty_like(gains.sample),
            np.empty_like(gains.gain),
            gains.most,
        )
        kernels.gains_by_sample(gains.by_camera, self._by_sample)
        none = np.zeros(gains.camera_count, dtype=np.int32)
        high = (np.diff(gains.cell_offsets) - 1).astype(np.int32)
        score, unknown = none.astype(np.int64), np.full(len(none), np.nan)
        root = Node(-bound, 0, 0, none, high, price, score, none, none - 1, unknown)
        self.leaf: IntArray | None = None
        # Totals over all tries: by how much they lowered the bound, and their scores.
        self._worth = self._score = 0.0
        self._open: list[Node] = []
        # Not in the heap: nodes being branched on, and children whose prices still have to adapt.
        self._choices: list[_Choice] = []
        self._narrow: list[Node] = []
        self._keep(self._adapt([Part(root, -1, 0, 0)], goal), goal)

    @property
    def bound(self) -> int:
        """The largest bound of the open nodes, which no gain above the goal exceeds; 0 if none."""
        return max((-node.negative_bound for node in self._first(1)), default=0)

    def plans(self, count: int) -> list[IntArray]:
        """Return the best cells (C,) of up to ``count`` nodes, those with the highest bounds."""
        return [node.cell.copy() for node in self._first(count)]

    def _first(self, count: int) -> list[Node]:
        """Return up to ``count`` nodes with the highest bounds."""
        taken = [choice.node for choice in self._choices] + self._narrow
        return heapq.nsmallest(count, taken + heapq.nsmallest(count, self._open))

    @property
    def _price_count(self) -> int:
        """How many prices a node has."""
        return len(self._gains.most)

    @property
    def exhausted(self) -> bool:
        """Whether no node is left to branch on, or no memory for more."""
        node = 8 * self._price_count + 32 * self._gains.camera_count
        left = len(self._open) + len(self._choices) + len(self._narrow)
        return not left or len(self._open) * node > _OPEN_BYTES

    def step(self, goal: int) -> None:
        """Take one step of branching on a batch of nodes, those with the highest bounds.

        Nodes that cannot exceed ``goal`` are dropped.
        """
        self._choices = [c for c in self._choices if -c.node.negative_bound > goal]
        self._narrow = [node for node in self._narrow if -node.negative_bound > goal]
        if self._narrow:
            narrow, self._narrow = self._narrow, []
            self._keep(self._adapt([Part(node, -1, 0, 0) for node in narrow], goal), goal)
            return
        if not self._choices:
            worth = self._worth_of_score
            self._choices = [_Choice(node, goal, worth) for node in self._next(goal)]
        self._try(goal)
        done = [choice for choice in self._choices if not choice.open]
        self._choices = [choice for choice in self._choices if choice.open]
        for child in (child for choice in done for child in choice.children):
            if (child.depth - 1) % _WIDE_EVERY:
                self._keep([child], goal)
            else:
                self._narrow.append(child)

    def _try(self, goal: int) -> None:
        """Try one more camera of every node that is being branched on."""
        cameras = [choice.next() for choice in self._choices]
        parts = [choice.halves(c) for choice, c in zip(self._choices, cameras, strict=True)]
        halves = self._adapt([half for both in parts for half in both], goal)
        for k, (choice, camera) in enumerate(zip(self._choices, cameras, strict=True)):
            self._worth += choice.tried(camera, halves[2 * k : 2 * k + 2])
            self._score += choice.node.score[camera]

    def _next(self, goal: int) -> list[Node]:
        """Take the nodes to branch on: none if none can exceed ``goal`` or the next is a leaf."""
        work = STEPS * max(len(self._gains.gain), 1)
        batch = max(1, min(8, _WORK // work))
        nodes: list[Node] = []
        while self._open and len(nodes) < batch:
            node = heapq.heappop(self._open)
            if -node.negative_bound <= goal:
                self._open.clear()
            elif (node.low >= node.high).all():
                self.leaf = np.minimum(node.low, node.high)
                break
            else:
                nodes.append(node)
        return nodes

    @property
    def _worth_of_score(self) -> float:
        """By how much a score of 1 is expected to lower the bound; inf before the first try."""
        return self._worth / self._score if self._score else np.inf

    def _keep(self, nodes: list[Node], goal: int) -> None:
        for node in nodes:
            if -node.negative_bound > goal:
                heapq.heappush(self._open, node)

    def _adapt(self, parts: list[Part], goal: int) -> list[Node]:
        """Bound the parts; return them as nodes.

        Prices adapt around the confined camera, or everywhere if there is none.
        """
        if not parts:
            return []
        camera, first, last = (
            np.array(cut, dtype=np.int64) for cut in list(zip(*parts, strict=True))[1:]
        )
        nodes = _stacked([part.node for part in parts])
        wide = (camera < 0) | (self._gains.shots > 1)
        self._confine(kernels.Cuts(camera, first, last, wide), nodes, goal)
        adapted = []
        for b, part in enumerate(parts):
            self.nodes += 1
            row = {name: array[b].copy() for name, array in nodes._asdict().items()}
            bound, depth = int(row.pop("bound")), part.node.depth + int(part.camera >= 0)
            adapted.append(Node(-bound, self.nodes, depth, worth=part.node.worth, **row))
        return adapted

    def _confine(self, cuts: kernels.Cuts, nodes: kernels.Nodes, goal: int) -> None:
        """Confine one camera of each node, and bound what is left."""
        # Threads meet once per batch here, not at every step.
        with kernels.threads_for(STEPS * len(self._gains.gain)):
            kernels.confine(
                cuts,
                self._near,
                *self._gains.priced,
                self._by_sample,
                nodes,
                goal,
                REACH,
                STEPS,
            )


class _Choice:
    """The search for the camera to branch a node on, by strong branching.

    Attributes
    ----------
    node : Node
    children : list of Node
        The halves of the best camera tried so far that can still exceed the goal.
    """

    def __init__(self, node: Node, goal: int, worth_of_score: float) -> None:
        self.node = node
        self.children: list[Node] = []
        self._slack = -node.negative_bound - goal
        self._best = -1.0
        self._tries = _TRIES if node.depth else _ROOT_TRIES
        torn = np.flatnonzero(node.score > 0)
        if not len(torn):  # no camera alternated: take the widest range
            torn = np.array([np.argmax(node.high - node.low)])
        score, known = node.score[torn], node.worth[torn]
        unknown = np.isnan(known)
        worth = known.copy()
        worth[unknown] = worth_of_score * np.maximum(score[unknown], 1)
        order = np.lexsort((-score, -worth))
        self._cameras = torn[order].tolist()
        self._expected = worth[order].tolist()
        self._worth = node.worth.copy()

    @property
    def open(self) -> bool:
        """Whether another camera is likely to beat the best so far."""
        if not (self.children and self._tries and self._cameras):
            return False
        return bool(self._best < _ENOUGH * self._expected[0])

    def next(self) -> int:
        """Return the camera to try."""
        self._tries -= 1
        self._expected.pop(0)
        camera: int = self._cameras.pop(0)
        return camera

    def halves(self, camera: int) -> tuple[Part, Part]:
        """Return the two parts that a camera's range is cut into."""
        node = self.node
        low, high, split = (int(ends[camera]) for ends in (node.low, node.high, node.split))
        if node.score[camera] <= 0:
            split = (low + high) // 2
        return Part(node, camera, low, split), Part(node, camera, split + 1, high)

    def tried(self, camera: int, halves: list[Node]) -> float:
        """Record the bounds of a camera's halves; return by how much they lower the node's."""
        least = _LEAST * self._slack
        lowered = [half.negative_bound - self.node.negative_bound for half in halves]
        first, second = (min(max(by, least), self._slack) for by in lowered)
        self._worth[camera] = worth = math.sqrt(first * second)
        if worth > self._best:
            self._best = worth
            self.children = [
                n for n in halves if n.negative_bound - self.node.negative_bound < self._slack
            ]
        for child in self.children:
            child.worth = self._worth
        return worth


def _stacked(nodes: list[Node]) -> kernels.Nodes:
    """Return copies of the nodes' arrays, a row each."""
    bound = np.array([-node.negative_bound for node in nodes], dtype=np.int64)
    rows = (np.stack([getattr(node, name) for node in nodes]) for name in kernels.Nodes._fields[1:])
    return kernels.Nodes(bound, *rows)


def _overlapping(gains: Gains, price: Offsets, most: int) -> kernels.Neighbourhoods:
    """Return, per camera, itself and those that share most samples of active pairs with it.

    ``most`` in all.
    """
    from scipy.sparse import csr_array  # noqa: PLC0415 - takes as long as a plan

    cameras = np.repeat(np.arange(gains.camera_count), np.diff(gains.offsets))
    active = gains.gain > (price - (gains.most >> REACH))[gains.sample]
    holds = csr_array(
        (np.ones(int(active.sum()), dtype=np.int32), (cameras[active], gains.sample[active])),
        shape=(gains.camera_count, len(gains.most)),
    )
    common = (holds @ holds.T).tocsr()
    near = []
    for c in range(gains.camera_count):
        part = slice(common.indptr[c], common.indptr[c + 1])
        others, counts = common.indices[part], common.data[part]
        order = np.lexsort((others, -counts))
        others = others[order]
        near.append(np.concatenate([[c], others[others != c][: most - 1]]).astype(np.int32))
    offsets = np.cumsum([0] + [len(n) for n in near])
    return kernels.Neighbourhoods(offsets, np.concatenate(near))
