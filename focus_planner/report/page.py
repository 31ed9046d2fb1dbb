# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A report as one HTML file that needs nothing else and asks for nothing.

What it says is in the file as text and tables, which need no program. The program draws the surface
in 3D from the payload, and lets the tables be sorted. A policy within the page forbids it, and
whatever a name in a file may hide, to load, send or run anything else.
"""

from __future__ import annotations

import base64
import hashlib
from functools import cache
from importlib.resources import files

from focus_planner.report.content import ReportContent
from focus_planner.report.markup import text
from focus_planner.report.payload import encoded_payload
from focus_planner.report.sections import cameras, costs, facts, head, origin, steps, views

_PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<meta name="generator" content="focus_planner">
<title>{title}</title>
<link rel="icon" href="data:,">
<style>{style}</style>
</head>
<body>
<header class="top">
<div><p class="kicker">Focus plan</p><h1>{title}</h1></div>
<div id="tools"></div>
</header>
<main>
{head}
<section id="view" aria-labelledby="view-title">
<h2 id="view-title">Surface and cameras</h2>
<div id="stage"><p class="about">The surface is drawn here by the program in this page: it takes
JavaScript and WebGL. All else is below.</p></div>
</section>
{facts}
<div class="pair">
{costs}
{steps}
</div>
{views}
{cameras}
{origin}
</main>
<script type="text/plain" id="payload">{payload}</script>
<script>{program}</script>
</body>
</html>
"""


def report_page(content: ReportContent) -> str:
    """Return the report as an HTML page; the same for the same content."""
    style, program = _bundled("report.css"), _bundled("report.js")
    return _PAGE.format(
        policy=_policy(style, program),
        title=text(content.title),
        style=style,
        program=program,
        head=head(content),
        facts=facts(content),
        costs=costs(content),
        steps=steps(content),
        views=views(content),
        cameras=cameras(content),
        origin=origin(content),
        payload=encoded_payload(content),
    )


def _policy(style: str, program: str) -> str:
    """Return what the browser lets the page do: its own style and program, pictures within it."""
    return "; ".join(
        (
            "default-src 'none'",
            f"script-src '{_digest(program)}'",
            f"style-src '{_digest(style)}'",
            "img-src data: blob:",
            "base-uri 'none'",
            "form-action 'none'",
        )
    )


def _digest(inline: str) -> str:
    digest = hashlib.sha256(inline.encode()).digest()
    return f"sha256-{base64.b64encode(digest).decode('ascii')}"


@cache
def _bundled(name: str) -> str:
    """Return a file that ``make bundle`` builds from ``report_page/``."""
    return (files("focus_planner.report") / "bundle" / name).read_text(encoding="utf-8")
