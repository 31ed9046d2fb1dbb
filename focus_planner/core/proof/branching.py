"""Branch and bound on prices: what is left of the gap where the relaxation is torn.

A node confines cameras to parts of their cells. It branches on the camera whose best cell, over
the last price steps, alternated most between cells with the deepest valley between them, and
cuts it there in two. A child inherits its parent's prices; only those near the cut camera need to
adapt, which makes a node cost a tenth of a bound from nothing. Reduced costs cut off the cells at
either end of each range that no better plan can use. The node with the highest bound goes first.

Tried on bodies beside it: HiGHS on what reduced costs leave, ten times as slow at 1,000 samples and
more above; and pairs of cameras as blocks of their own in the bound, solved exactly by the sweep of
kernels/pairs.py, which closed a quarter of the gap at most.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass, field

import numpy as np
from scipy.sparse import csr_array

from focus_planner.core import kernels
from focus_planner.core.problem import Offsets
from focus_planner.core.proof.gains import Gains
from focus_planner.core.types import IntArray

# A price adapts within the cameras that overlap most with the cut one; each so many generations
# all prices adapt.
_NEAR = 20
_WIDE_EVERY = 4
_REACH = 3  # as in prices.py, 2^-3 of the sample's most
_STEPS = 60
# Work of one batch of nodes, in pairs times steps: some 20 ms.
_WORK = 20_000_000
_OPEN_BYTES = 1_000_000_000


@dataclass(order=True)
class _Node:
    """``low``, ``high`` (C,), ``price`` (N,), ``score``, ``split`` (C,); highest bound first."""

    negative_bound: int
    number: int
    depth: int = field(compare=False)
    low: IntArray = field(compare=False)
    high: IntArray = field(compare=False)
    price: Offsets = field(compare=False)
    score: Offsets = field(compare=False)
    split: IntArray = field(compare=False)
    cell: IntArray = field(compare=False)


class Branching:
    """The open nodes.

    Parameters
    ----------
    gains : Gains
    price : (N,) array of int64
    bound : int
        Exactly what these prices prove.
    goal : int
        Nodes that cannot gain more are dropped.

    Attributes
    ----------
    nodes : int
        Bounded so far.
    leaf : (C,) array of int32, or None
        The cells of a plan that branching came down to.
    """

    def __init__(self, gains: Gains, price: Offsets, bound: int, goal: int) -> None:
        self.nodes = 0
        self._gains = gains
        self._near_offsets, self._near = _overlapping(gains, price)
        self._by_sample = (
            np.empty(len(gains.most) + 1, dtype=np.int64),
            np.empty_like(gains.sample),
            np.empty_like(gains.gain),
        )
        kernels.gains_by_sample(gains.offsets, gains.sample, gains.gain, *self._by_sample)
        none = np.zeros(gains.camera_count, dtype=np.int32)
        high = (np.diff(gains.cell_offsets) - 1).astype(np.int32)
        root = _Node(-bound, 0, 0, none, high, price, none.astype(np.int64), none, none - 1)
        self.leaf: IntArray | None = None
        self._open: list[_Node] = []
        self._adapt([(root, -1, 0, 0)], goal)

    @property
    def bound(self) -> int:
        """What no plan exceeds unless it gains no more than the goal; 0 if no node is open."""
        return -self._open[0].negative_bound if self._open else 0

    def plans(self, count: int) -> list[IntArray]:
        """Return the best cells (C,) of the nodes that go next, of so many at most."""
        return [node.cell.copy() for node in heapq.nsmallest(count, self._open)]

    @property
    def exhausted(self) -> bool:
        """Whether no node is left to branch on, or no room."""
        node = 8 * len(self._gains.most) + 24 * self._gains.camera_count
        return not self._open or len(self._open) * node > _OPEN_BYTES

    def step(self, goal: int) -> None:
        """Branch on a batch of nodes, those with the highest bounds, that may exceed ``goal``."""
        children: list[tuple[_Node, int, int, int]] = []
        work = _STEPS * max(len(self._gains.gain), 1)
        batch = max(1, min(8, _WORK // work))
        while self._open and len(children) < 2 * batch:
            node = heapq.heappop(self._open)
            if -node.negative_bound <= goal:
                self._open.clear()
                break
            camera = int(np.argmax(node.score))
            split = int(node.split[camera])
            if node.score[camera] <= 0:
                camera = int(np.argmax(node.high - node.low))
                split = int(node.low[camera] + node.high[camera]) // 2
                if node.high[camera] <= node.low[camera]:
                    self.leaf = np.minimum(node.low, node.high)
                    break
            children.append((node, camera, int(node.low[camera]), split))
            children.append((node, camera, split + 1, int(node.high[camera])))
        self._adapt(children, goal)

    def _adapt(self, children: list[tuple[_Node, int, int, int]], goal: int) -> None:
        """Bound the children, each a parent with a camera confined; keep those above ``goal``."""
        if not children:
            return
        parents = [child[0] for child in children]
        bounds = np.array([-node.negative_bound for node in parents], dtype=np.int64)
        low, high = (np.stack([getattr(n, a) for n in parents]) for a in ("low", "high"))
        price, score = (np.stack([getattr(n, a) for n in parents]) for a in ("price", "score"))
        split, cell = (np.stack([getattr(n, a) for n in parents]) for a in ("split", "cell"))
        _, *cuts = zip(*children, strict=True)
        camera, first, last = (np.array(cut, dtype=np.int64) for cut in cuts)
        wide = np.array([node.depth % _WIDE_EVERY == 0 for node in parents])
        kernels.confine(
            camera,
            first,
            last,
            wide,
            self._near_offsets,
            self._near,
            *self._gains.pairs,
            *self._by_sample,
            self._gains.most,
            _REACH,
            bounds,
            low,
            high,
            price,
            score,
            split,
            cell,
            goal,
            _STEPS,
        )
        for b, parent in enumerate(parents):
            self.nodes += 1
            if bounds[b] > goal:
                own = (array[b].copy() for array in (low, high, price, score, split, cell))
                node = _Node(-int(bounds[b]), self.nodes, parent.depth + 1, *own)
                heapq.heappush(self._open, node)


def _overlapping(gains: Gains, price: Offsets) -> tuple[Offsets, IntArray]:
    """Return, per camera, itself and those that hold most samples near their price with it."""
    cameras = np.repeat(np.arange(gains.camera_count), np.diff(gains.offsets))
    active = gains.gain > (price - (gains.most >> _REACH))[gains.sample]
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
        near.append(np.concatenate([[c], others[others != c][: _NEAR - 1]]).astype(np.int32))
    return np.cumsum([0] + [len(n) for n in near]), np.concatenate(near)
