# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""How ``make docs`` builds the site: the pages of this folder and an API reference.

Nothing is fetched, neither here nor by a browser that shows the site: no web fonts, no CDN, no
inventories of other projects. Search runs in the browser, from ``file://`` too.
"""

from __future__ import annotations

import re
import sys
from functools import partial
from inspect import isclass
from pathlib import Path
from typing import Any

from docutils.nodes import Element
from sphinx.addnodes import pending_xref
from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment
from sphinx.ext.napoleon.docstring import NumpyDocstring
from sphinx.util.nodes import make_refnode

DOCS = Path(__file__).parent
sys.path.insert(0, str(DOCS.parent))

import focus_planner  # noqa: E402 - this checkout's, whatever is installed

project = "focus_planner"
author = "focus_planner developers"
copyright = "focus_planner developers, Apache-2.0"  # noqa: A001 - Sphinx's name

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
# Paragraphs of an evaluation are on its page.
exclude_patterns = ["_build", "_templates", "results/*/*/paragraph.md"]
templates_path = ["_templates"]

# --- pages -------------------------------------------------------------------------------------

# Anchors as GitHub makes them, so that links work there and here.
myst_heading_anchors = 4
myst_enable_extensions = ["colon_fence", "deflist"]
myst_links_external_new_tab = True
# A prompt is not part of a command.
copybutton_prompt_text = "$ "

# --- API reference -----------------------------------------------------------------------------

autosummary_generate = True
autosummary_ignore_module_all = False
autodoc_default_options = {
    "members": True,
    "ignore-module-all": True,  # what a package passes on is described where it is defined
}
add_module_names = False
python_maximum_signature_line_length = 88
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_preserve_defaults = True
napoleon_google_docstring = False
napoleon_use_param = False
napoleon_use_rtype = False
# As parameters are shown: two of a kind may share a line, as in "near_limit, far_limit : float".
# What nodes have on the graph is shown likewise.
napoleon_custom_sections = [
    (title, "params_style")
    for title in ("Attributes", "Subscribes", "Publishes", "Serves", "Calls")
]

# What has no page here: names of other projects, whose inventories would have to be fetched, and
# the words by which docstrings describe arrays. Names of our own are not excused.
nitpick_ignore_regex = [
    ("py:.*", r"(?!focus_planner\.).*\..*"),  # numpy.float64
    ("py:.*", r"[a-z0-9{\"'\[(].*|[A-Z]|.* .*"),  # array, (N, 3), C + 1
    ("py:class", "Path|PurePosixPath|FloatArray|NDArray|Surface"),
]

# --- looks -------------------------------------------------------------------------------------

html_theme = "furo"
html_title = "focus_planner"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_show_sphinx = False
html_show_search_summary = False  # browsers fetch nothing from file://
pygments_style = "friendly"
html_copy_source = False
html_show_sourcelink = False
_FONTS = {
    "font-stack": "system-ui, -apple-system, 'Segoe UI', Roboto, 'Helvetica Neue', sans-serif",
    "font-stack--monospace": "ui-monospace, SFMono-Regular, Menlo, Consolas, monospace",
}
html_theme_options = {
    "light_css_variables": {
        **_FONTS,
        "color-brand-primary": "#7a1f5c",
        "color-brand-content": "#7a1f5c",
    },
    "dark_css_variables": {
        **_FONTS,
        "color-brand-primary": "#e59ac6",
        "color-brand-content": "#e59ac6",
    },
}


# --- pages outside this folder ------------------------------------------------------------------

# What pages link to on GitHub, and what shows the same in the site.
_SHOWN_BY = {
    "../CONTRIBUTING.md": "contributing.md",
    "../QUALITY_DECLARATION.md": "quality_declaration.md",
    "../bags/README.md": "recorded_runs.md",
    "../examples/README.md": "examples.md",
}
_INCLUDE = re.compile(r"^```\{include\} (\.\./\S+\.md)\n```$", re.MULTILINE)
_LINK = re.compile(r"\[([^\[\]]+)\]\((?!https?:|#)([^)\s]+)\)")


def prepare_page(app: Sphinx, _page: str, source: list[str]) -> None:
    """Put in pages from outside this folder, and keep links to such pages within the site."""
    source[0] = _INCLUDE.sub(partial(_included, app), source[0])
    source[0] = _LINK.sub(_within_the_site, source[0])


def _included(app: Sphinx, include: re.Match[str]) -> str:
    """Return a page from outside, its links as seen from here."""
    path = DOCS / include[1]
    app.env.note_dependency(str(path.resolve()))
    folder = Path(include[1]).parent
    text = path.read_text(encoding="utf-8")
    return _LINK.sub(lambda link: f"[{link[1]}]({(folder / link[2]).as_posix()})", text)


def _within_the_site(link: re.Match[str]) -> str:
    """Return a link to the page that shows the same; the text alone where none does."""
    text, target = link.groups()
    path, mark, place = target.partition("#")
    if path in _SHOWN_BY:
        return f"[{text}]({_SHOWN_BY[path]}{mark}{place})"
    return text if path.startswith("../") and path.endswith((".md", ".rst")) else link[0]


# --- references --------------------------------------------------------------------------------


def find_by_last_name(
    app: Sphinx, env: BuildEnvironment, node: pending_xref, text: Element
) -> Element | None:
    """Lead a reference such as ``LensControl`` to the only object of that name."""
    target = node.get("reftarget", "")
    if node.get("refdomain") != "py" or "." in target:
        return None
    found = [
        (name, entry)
        for name, entry in env.domains.python_domain.objects.items()
        if name.rpartition(".")[2] == target and not entry.aliased
    ]
    if len(found) != 1:
        return None
    (name, entry), page = found[0], node["refdoc"]
    return make_refnode(app.builder, page, entry.docname, entry.node_id, text, name)


def keep_attribute_docstring(self: NumpyDocstring) -> list[str]:
    """Return an attribute's docstring as it is: what is before a colon in it is not its type."""
    return self._consume_to_end()


NumpyDocstring._parse_attribute_docstring = keep_attribute_docstring  # noqa: SLF001

# --- the list of public names ------------------------------------------------------------------


def _entry(name: str) -> str:
    """Return a row of the table of public names, linked to where the name is defined."""
    target = getattr(focus_planner, name)
    role = "class" if isclass(target) else "func"
    summary = (target.__doc__ or "").strip().splitlines()[0]
    return f"| {{py:{role}}}`{name} <{target.__module__}.{target.__qualname__}>` | {summary} |"


def write_public_names(_: Sphinx) -> None:
    """Write ``api/public_names.md``, to be included by ``api/index.md``."""
    rows = [_entry(name) for name in sorted(focus_planner.__all__, key=str.lower)]
    text = "\n".join(["| name | what |", "|---|---|", *rows]) + "\n"
    (DOCS / "api" / "public_names.inc").write_text(text, encoding="utf-8")


def setup(app: Sphinx) -> dict[str, Any]:
    """Connect what is generated."""
    app.connect("builder-inited", write_public_names)
    app.connect("source-read", prepare_page)
    app.connect("missing-reference", find_by_last_name)
    return {"parallel_read_safe": True}
