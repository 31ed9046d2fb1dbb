# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The arrays that several kernels take together, as NamedTuples.

Sizes: C cameras, N samples, P pairs of a sample and a camera that sees it, G pairs that gain from
focus, M cells, T camera tuples of k cameras each. Costs and gains are whole units
(``problem/cells.py``); a camera's cells are counted from its first.

A kernel reads a tuple's arrays into local names before its loops. The body of a ``prange`` loop
must: there, Numba 0.68 silently drops assignments to the elements of a tuple's array.
"""

from __future__ import annotations

from typing import NamedTuple

from focus_planner.core.arrays import IntArray, Offsets


class PairsBySample(NamedTuple):
    """Samples and the cameras that see them, sample by sample, cameras ascending.

    Attributes
    ----------
    offsets : (N + 1,) array of int64
        Sample p's pairs are ``offsets[p]`` to ``offsets[p + 1]``.
    camera : (P,) array of int32
    base : (P,) array of int64
        Cost in focus, units.
    first, last : (P,) arrays of int32
        The camera's cells that hold the sample in focus; first > last if none does.
    """

    offsets: Offsets
    camera: IntArray
    base: Offsets
    first: IntArray
    last: IntArray


class PairsByCamera(NamedTuple):
    """The same pairs camera by camera, samples ascending.

    Attributes
    ----------
    offsets : (C + 1,) array of int64
        Camera c's pairs are ``offsets[c]`` to ``offsets[c + 1]``.
    sample : (P,) array of int32
    base, first, last : (P,) arrays
        As in :class:`PairsBySample`.
    """

    offsets: Offsets
    sample: IntArray
    base: Offsets
    first: IntArray
    last: IntArray


class CameraViews(NamedTuple):
    """Which cameras are one view, and how many views every sample needs.

    Attributes
    ----------
    number : (C,) array of int32
        Each camera's view. Shots of one camera of the rig are one view: neighbours, with the same
        pairs.
    offsets : (V + 1,) array of int64
        View v's cameras are ``offsets[v]`` to ``offsets[v + 1]``.
    needed : int
        A sample costs the sum of so many least costs, each of another view.
    missing : (N,) array of int64
        What a view that is missing costs, units: no view costs more. ``NEVER`` where one view is
        enough, since any is taken then.
    """

    number: IntArray
    offsets: Offsets
    needed: int
    missing: Offsets


class GainsByCamera(NamedTuple):
    """What samples gain from focus, camera by camera, samples ascending.

    Attributes
    ----------
    offsets : (C + 1,) array of int64
        Camera c's pairs are ``offsets[c]`` to ``offsets[c + 1]``.
    sample : (G,) array of int32
    gain : (G,) array of int64
        Units, above 0.
    first, last : (G,) arrays of int32
        The cells that hold the sample in focus.
    """

    offsets: Offsets
    sample: IntArray
    gain: Offsets
    first: IntArray
    last: IntArray


class GainsBySample(NamedTuple):
    """The same gains sample by sample, cameras ascending.

    Attributes
    ----------
    offsets : (N + 1,) array of int64
        Sample p's pairs are ``offsets[p]`` to ``offsets[p + 1]``.
    camera : (G,) array of int32
    gain : (G,) array of int64
        Units.
    most : (N,) array of int64
        The sample's largest gain, units; 0 if it has none.
    """

    offsets: Offsets
    camera: IntArray
    gain: Offsets
    most: Offsets


class BlurredViews(NamedTuple):
    """What views gain out of focus, sample by sample, one view per camera of the rig.

    Attributes
    ----------
    offsets : (N + 1,) array of int64
        Sample p's are ``offsets[p]`` to ``offsets[p + 1]``: fewer than it needs views.
    gain : (B,) array of int64
        Units, above 0.
    """

    offsets: Offsets
    gain: Offsets


class PricedPairs(NamedTuple):
    """What prices bound.

    Kernels with ``prange`` loops take its parts: Numba takes no tuples of tuples into these.

    Attributes
    ----------
    gains, blurred : GainsByCamera
        What pairs gain in focus, and what those gain that gain even out of focus.
    blurred_views : BlurredViews
        The latter sample by sample; empty if pictures are limited.
    cell_offsets : (C + 1,) array of int64
        Camera c's cells are ``cell_offsets[c]`` to ``cell_offsets[c + 1]``.
    views, shots : int
        How many views each sample needs, and how many cameras, one after the other, are one view.
    """

    gains: GainsByCamera
    blurred: GainsByCamera
    blurred_views: BlurredViews
    cell_offsets: Offsets
    views: int
    shots: int


class CameraTuples(NamedTuple):
    """Camera tuples, batch by batch, with the samples that each one's cameras share.

    Attributes
    ----------
    cameras : (T, k) array of int32
        The last camera of a triple is the one with the fewest cells.
    batch_offsets : (B + 1,) array of int64
        Tuples ``batch_offsets[b]`` to ``batch_offsets[b + 1]`` do not influence each other.
    shared_offsets : (T + 1,) array of int64
        Tuple t's shared samples are ``shared_offsets[t]`` to ``shared_offsets[t + 1]``.
    samples : (L,) array of int32
        The samples that at least two cameras of the tuple see, ascending.
    bases : (L, k) array of int64
        Their base cost with each of the tuple's cameras, ``NEVER`` where it does not see them.
    firsts, lasts : (L, k) arrays of int32
        The cells that hold them in focus.
    """

    cameras: IntArray
    batch_offsets: Offsets
    shared_offsets: Offsets
    samples: IntArray
    bases: Offsets
    firsts: IntArray
    lasts: IntArray


class SharedSamples(NamedTuple):
    """One tuple's shared samples; see :class:`CameraTuples`."""

    samples: IntArray
    bases: Offsets
    firsts: IntArray
    lasts: IntArray


class JointStep(NamedTuple):
    """The problem of one tuple's best step.

    Member m's ``steps`` begin at ``begin[m]``; ``costs`` is what each shared sample costs, for
    every set of members that hold it; its first column is -1 if the sample is not the tuple's to
    re-assign. ``rectangles`` and ``weights`` are as :func:`best_pair` takes them; ``third`` are the
    shared samples that the third camera may gain.
    """

    steps: Offsets
    begin: Offsets
    costs: Offsets
    rectangles: IntArray
    weights: Offsets
    third: IntArray
