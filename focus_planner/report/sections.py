# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The parts of a report that are there without its program: words and tables."""

from __future__ import annotations

import json
from typing import Any

from focus_planner.core.planning.plan import CameraStatus
from focus_planner.io.lens_sheet.content import Cell, Column, Kind, Row
from focus_planner.report.content import CostRow, ReportContent, SharpRow, Step
from focus_planner.report.figures import bar, convergence, depth_range, depths
from focus_planner.report.markup import definitions, prose, text
from focus_planner.report.rounding import change, floored

_STATUS = {
    CameraStatus.PLANNED: "planned",
    CameraStatus.UNASSIGNED: "others image it better",
    CameraStatus.SEES_NOTHING: "sees nothing",
    CameraStatus.DROPPED: "takes no picture",
    CameraStatus.UNKNOWN: "unknown",
}
_MOST_STEPS = 200  # in the table; all are in the curve


def head(content: ReportContent) -> str:
    """Return the verdict and the notes."""
    notes = "".join(f"<li>{prose(note.text)}</li>" for note in content.notes)
    return f'<p class="verdict">{prose(content.verdict)}</p>' + (
        f'<ul class="notes" aria-label="Notes">{notes}</ul>' if notes else ""
    )


def facts(content: ReportContent) -> str:
    """Return what was planned, how and when; nothing if it is unknown."""
    if not content.facts:
        return ""
    return (
        '<section id="facts" aria-labelledby="facts-title"><h2 id="facts-title">What was planned'
        f"</h2>{definitions(content.facts, 'facts')}</section>"
    )


# --- costs -------------------------------------------------------------------------------------


def costs(content: ReportContent) -> str:
    """Return the comparison of costs as a table with a bar per row."""
    if not content.costs:
        return ""
    shown = [row.cost if row.fresh_cost is None else row.fresh_cost for row in content.costs]
    most = max((value for value in shown if value is not None), default=0.0)
    rows = "".join(_cost_row(row, most) for row in content.costs)
    weights = ", by importance" if content.surface.importance is not None else ""
    plan = content.plans[0].plan
    of_views = (
        f" A piece of surface costs the mean of its {plan.views} best views, 1 for each that is"
        " missing."
        if plan.views > 1
        else ""
    )
    compare = of_views + _comparing(content.costs)
    return f"""<section id="costs" aria-labelledby="costs-title">
<h2 id="costs-title">Cost</h2>
<p class="about">Of 1000, as a mean over the surface{weights}; 0 is perfect, 1000 is seen by no
camera. Filled bars: on fresh samples, which no plan was made on, with their standard
error.{compare}</p>
<div class="scroll" tabindex="0" role="region" aria-label="Costs"><table class="costs">
<thead><tr><th scope="col">plan</th><th scope="col"><span class="hidden">bar</span></th>
<th scope="col" class="number">fresh cost</th><th scope="col" class="number">change</th>
<th scope="col" class="number">in focus<small>of the surface</small></th>
<th scope="col" class="number">cost<small>as planned</small></th></tr></thead>
<tbody>{rows}</tbody></table></div>
</section>"""


def _comparing(rows: tuple[CostRow, ...]) -> str:
    """Return what is said of costs as planned that do not compare."""
    planned = [row for row in rows if row.cost is not None]
    if any(row.other_measure for row in planned):
        return (
            " The costs as planned are for different numbers of views or limits of resolution, and"
            " do not compare; the fresh ones are all for what this plan was made for."
        )
    if any(row.other_samples for row in planned):
        return (
            " The costs as planned are on different samples, and do not compare; the fresh ones are"
            " on the same."
        )
    return ""


def _cost_row(row: CostRow, most: float) -> str:
    fresh = "–" if row.fresh_cost is None else f"{row.fresh_cost:.1f}"
    if row.fresh_cost is not None and row.standard_error is not None:
        fresh += f"<small> ± {row.standard_error:.1f}</small>"
    gained = "–" if row.change is None else prose(change(row.change))
    share = (
        "–" if row.in_focus_share is None else f"{100 * row.in_focus_share:.1f}\N{NO-BREAK SPACE}%"
    )
    cost = "–"
    if row.cost is not None:
        # Without one on fresh samples, it is a bound.
        cost = floored(row.cost) if row.fresh_cost is None else f"{row.cost:.1f}"
    return (
        f"<tr{' class=reported' if row.reported else ''}>"
        f'<th scope="row">{text(row.title)}</th><td class="bar">{bar(row, most)}</td>'
        f'<td class="number">{fresh}</td><td class="number">{gained}</td>'
        f'<td class="number">{share}</td><td class="number">{cost}</td></tr>'
    )


def views(content: ReportContent) -> str:
    """Return how much is sharp in how many views as a table; nothing if it is unknown."""
    told = [row for row in content.sharp if row.shares]
    if not told:
        return ""
    headings = "".join(
        f'<th scope="col" class="number">in {count}{" or more" if count > 1 else ""}'
        f"<small>view{'s' * (count > 1)}</small></th>"
        for count, _, _ in told[0].shares
    )
    rows = "".join(map(_views_row, told))
    return f"""<section id="sharp-views" aria-labelledby="sharp-views-title">
<h2 id="sharp-views-title">Sharp views</h2>
<p class="about">How much of the surface is sharp in the pictures of how many cameras, with standard
errors, and how finely cameras image what is in focus in their pictures and best there: millimetres
along the surface per pixel, in the direction in which it is coarsest. All on fresh samples.</p>
<div class="scroll" tabindex="0" role="region" aria-label="Sharp views"><table>
<thead><tr><th scope="col">plan</th>{headings}
<th scope="col" class="number">resolution<small>median, mm/pixel</small></th>
<th scope="col" class="number">90 %<small>or finer, mm/pixel</small></th></tr></thead>
<tbody>{rows}</tbody></table></div>
</section>"""


def _views_row(row: SharpRow) -> str:
    cells = [
        f"{100 * share:.1f}\N{NO-BREAK SPACE}%<small> ± {100 * error:.1f}</small>"
        for _, share, error in row.shares
    ]
    finest = row.resolution
    cells += [f"{finest.median:.3g}", f"{finest.percentile_90:.3g}"] if finest else ["–", "–"]
    numbers = "".join(f'<td class="number">{cell}</td>' for cell in cells)
    mark = " class=reported" if row.reported else ""
    return f'<tr{mark}><th scope="row">{text(row.title)}</th>{numbers}</tr>'


def steps(content: ReportContent) -> str:
    """Return how the search went, as curves and as a table; nothing if it is unknown."""
    drawing = convergence(content.steps)
    if not drawing:
        return ""
    known = [step.cost for step in content.steps if step.cost is not None]
    rows = "".join(map(_step_row, _some(content.steps)))
    return f"""<section id="steps" aria-labelledby="steps-title">
<h2 id="steps-title">Convergence</h2>
<p class="about">From {known[0]:.1f} to {known[-1]:.1f} in {len(known)} steps, on the samples that
were planned on.</p>
{drawing}
<details><summary>Steps as a table</summary><div class="scroll" tabindex="0" role="region"
aria-label="Steps"><table><thead><tr><th scope="col">stage</th>
<th scope="col" class="number">step</th><th scope="col" class="number">cost</th>
<th scope="col" class="number">lower bound</th><th scope="col" class="number">s</th></tr></thead>
<tbody>{rows}</tbody></table></div></details>
</section>"""


def _some(given: tuple[Step, ...]) -> tuple[Step, ...]:
    """Return the steps, or as many at equal intervals as fit the table, the last among them."""
    every = -(-len(given) // _MOST_STEPS)
    return given[::-1][::every][::-1]


def _step_row(step: Step) -> str:
    numbers = (
        str(step.iteration),
        "–" if step.cost is None else f"{step.cost:.1f}",
        "–" if step.lower_bound is None else floored(step.lower_bound),
        "–" if step.elapsed is None else f"{step.elapsed:.2f}",
    )
    cells = "".join(f'<td class="number">{number}</td>' for number in numbers)
    return f"<tr><td>{text(step.stage)}</td>{cells}</tr>"


# --- cameras -----------------------------------------------------------------------------------


def cameras(content: ReportContent) -> str:
    """Return the table of cameras: the lens sheet, and what each camera holds and sees."""
    sheet = content.sheet
    index = {camera.name: k for k, camera in enumerate(content.rig.cameras)}
    name = [column.key for column in sheet.columns].index("name")
    ends = depth_range(content.histograms)
    headings = "".join(map(_heading, sheet.columns))
    shots = ", by all shots" if content.plans[0].plan.shots > 1 else ""
    headings += (
        '<th scope="col" class="number extra" data-sort="number">held'
        f"<small>cm²{shots}</small></th>"
        f'<th scope="col" class="spark">depths seen<small>{ends[0]:.2f} to {ends[1]:.2f} m</small>'
        "</th>"
    )
    rows = []
    for row in sheet.rows:
        camera = index[str(row.cells[name].value)]
        rows.append(_camera_row(content, row, camera, ends))
    return f"""<section id="sheet" aria-labelledby="sheet-title">
<h2 id="sheet-title">{text(sheet.title)}</h2>
<div class="print-only">{definitions(sheet.facts, "facts")}</div>
<p class="about screen-only">Where to set each lens. Printed, these are pages of their own, with
boxes to tick. The bars are the depths that a camera sees; the band is its depth of field.</p>
<div id="filters"></div>
<div class="scroll tall" tabindex="0" role="region" aria-label="Cameras"><table class="sheet"
id="cameras"><thead><tr>{headings}</tr></thead>
<tbody>
{"".join(rows)}</tbody></table></div>
{definitions(sheet.measures, "facts measures")}
</section>"""


def _heading(column: Column) -> str:
    unit = f"<small>{text(column.unit)}</small>" if column.unit else ""
    sort = "" if column.kind is Kind.BOX else f' data-sort="{column.kind.value}"'
    return (
        f'<th scope="col" class="{column.kind.value} {text(column.key)}"{sort}>'
        f"{text(column.heading)}{unit}</th>"
    )


def _camera_row(content: ReportContent, row: Row, camera: int, ends: tuple[float, float]) -> str:
    plan = content.plans[0]
    focus = plan.plan.cameras[camera]
    cells = "".join(map(_cell, content.sheet.columns, row.cells))
    held = 1e4 * float(plan.held_area[camera])
    drawing = depths(content.histograms[camera], focus, ends)
    return (
        f'<tr data-camera="{camera}" data-status="{_STATUS[focus.status]}"'
        f"{' class=idle' if row.idle else ''}>{cells}"
        f'<td class="number extra" data-value="{held:.6g}">{held:.0f}</td>'
        f'<td class="spark">{drawing}</td></tr>\n'
    )


def _cell(column: Column, cell: Cell) -> str:
    if column.kind is Kind.BOX:
        box = f'<input type="checkbox" aria-label="{text(column.heading)}">'
        return f'<td class="box"><label>{box}</label></td>'
    shown = text(cell.text)
    if column.key == "name":
        return f'<th scope="row" class="name" data-value="{shown}">{shown}</th>'
    value = "" if cell.value is None else f' data-value="{text(cell.value)}"'
    return f'<td class="{column.kind.value} {text(column.key)}"{value}>{shown}</td>'


# --- the end -----------------------------------------------------------------------------------


def origin(content: ReportContent) -> str:
    """Return the run's parameters and the versions of what made it."""
    parameters = tuple((name, _value(value)) for name, value in content.parameters)
    parts = [
        f"<h3>{title}</h3>{definitions(entries, 'facts')}"
        for title, entries in (("Parameters", parameters), ("Versions", content.software))
        if entries
    ]
    if not parts:
        return ""
    return (
        '<section id="origin" aria-labelledby="origin-title"><h2 id="origin-title">Made with</h2>'
        f"<details><summary>Parameters and versions</summary>{''.join(parts)}</details></section>"
    )


def _value(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value, default=str, ensure_ascii=False)
