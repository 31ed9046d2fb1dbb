# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The page of an evaluation: made of its files alone, the same every time, and whole."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from focus_planner.core.validation import InputError
from focus_planner.evaluation.experiments import EXPERIMENTS
from focus_planner.evaluation.writing.evaluated import load_evaluated
from focus_planner.evaluation.writing.page import page_text, write_page, write_up
from focus_planner.evaluation.writing.setup import Setup

ROOT = Path(__file__).parents[3]
TABLE1 = EXPERIMENTS["table1"]
METHODS = ("closest", "average", "EM", "2-view", "2-view, all samples", "w₃ = 0")
SETUP = Setup(
    command="focus_planner evaluate scans --experiment table1 --output results",
    about="Two scans.",
    rig="the paper's, 168 cameras on a cylinder",
    notes=("taken with y up: so the cameras see most; --up says otherwise",),
    cores=4,
    workers="where 4 processes did a task each, on one core",
)


def evaluation(folder: Path, subjects=("anna", "bert")) -> Path:
    """Lay out what an evaluation leaves, with costs that are easily checked."""
    (folder / "table1").mkdir(parents=True)
    noted = {
        "conditions": {"samples": 1000, "judged": 65536, "seed": 7},
        "subjects": dict.fromkeys(subjects, "0"),
        "software": {"focus_planner": "0.2.0", "processor": "Some CPU", "numba": "0.68.0"},
    }
    (folder / "evaluation.json").write_text(json.dumps(noted))
    SETUP.save(folder)
    rows = ["subject,method,cost,fresh_cost,in_focus_area"]
    rows += [
        f'{name},"{method}",{300.0 - 10 * k + 2 * n},{310.0 - 10 * k},{1.0 + k / 10}'
        for n, name in enumerate(subjects)
        for k, method in enumerate(METHODS)
    ]
    (folder / "table1/results.csv").write_text("\n".join(rows) + "\n")
    seconds = ["subject,EM_seconds,task_seconds,task"]
    seconds += [f"{name},0.5,1.25,{n:016x}" for n, name in enumerate(subjects)]
    (folder / "table1/seconds.csv").write_text("\n".join(seconds) + "\n")
    return folder


def test_the_page_says_what_was_found_and_how_to_find_it_again(tmp_path):
    folder = evaluation(tmp_path / "results")
    text = page_text(load_evaluated(folder), tmp_path)
    for part in (
        "# Evaluation\n\nTwo scans.\n",
        "- **Subjects**: 2: `anna`, `bert`\n",
        "- **Rig**: the paper's, 168 cameras on a cylinder\n",
        "1,000 samples of each",
        "**judged** on 65,536 others; seed 7\n",
        "a machine with 4 cores (Some CPU), where 4 processes did a task each, on one core",
        "- Taken with y up: so the cameras see most; --up says otherwise\n",
        f"```text\n{SETUP.command}\n```\n",
        "- [Methods](#methods) (paper: Tab. 1, Sec. 4.3)\n",
        "## Methods\n",
        "`--experiment table1` · paper: Tab. 1, Sec. 4.3\n",
        "Every method planned for 2 subjects",
        "![Methods](results/table1/table1.png)",
        "[results.csv](results/table1/results.csv)",
        "2 tasks, 2.5 s in all.",
    ):
        assert part in text, part
    assert "failed" not in text


def test_what_the_subjects_are_may_begin_with_the_title(tmp_path):
    folder = evaluation(tmp_path / "results")
    replace(SETUP, about="# Two scans\n\nOf friends.").save(folder)
    text = page_text(load_evaluated(folder), tmp_path)
    assert text.startswith("# Two scans\n\nOf friends.\n\n- **Subjects**")


def test_links_are_seen_from_where_the_page_is(tmp_path):
    folder, page = evaluation(tmp_path / "a/results"), tmp_path / "b/page.md"
    write_page(folder, page)
    write_up(load_evaluated(folder), TABLE1)
    links = re.findall(r"\]\(([^)#]+)\)", page.read_text())
    assert len(links) == 3
    assert all((page.parent / link).is_file() for link in links)


def test_results_come_back_as_they_were_measured(tmp_path):
    results = load_evaluated(evaluation(tmp_path / "results")).results(TABLE1)
    assert results.conditions.seed == 7
    assert list(results.rows.columns) == [
        "subject",
        "method",
        "cost",
        "fresh_cost",
        "in_focus_area",
    ]
    assert list(results.rows.method[:6]) == list(METHODS)
    assert results.rows.cost.dtype == np.float64
    assert list(results.seconds.columns) == ["subject", "EM_seconds", "task_seconds"]


def test_the_same_files_give_the_same_bytes(tmp_path):
    made = []
    for name in ("one", "two"):
        folder = evaluation(tmp_path / name / "results")
        write_up(load_evaluated(folder), TABLE1)
        write_page(folder, tmp_path / name / "page.md")
        paths = ("results/table1/paragraph.md", "results/table1/table1.png", "page.md")
        made.append([(tmp_path / name / path).read_bytes() for path in paths])
    assert made[0] == made[1]
    with Image.open(tmp_path / "one/results/table1/table1.png") as image:
        assert image.size == (1200, 675)
        assert "Software" not in image.info


def test_the_page_says_what_failed(tmp_path):
    folder = evaluation(tmp_path / "results")
    (folder / "table1/failed.csv").write_text("subject,reason\nclara,why\n")
    text = page_text(load_evaluated(folder), tmp_path)
    assert (
        "**1 task failed and is missing above**: [failed.csv](results/table1/failed.csv)." in text
    )


def test_many_subjects_are_counted(tmp_path):
    folder = evaluation(tmp_path, [f"s{number:03}" for number in range(400)])
    assert "- **Subjects**: 400, from `s000` to `s399`\n" in page_text(
        load_evaluated(folder), tmp_path
    )


@pytest.mark.parametrize("name", ["evaluation.json", "setup.json"])
@pytest.mark.parametrize("content", ["[]", "{}", "no json"])
def test_a_folder_that_is_no_evaluation_is_refused(tmp_path, name, content):
    folder = evaluation(tmp_path / "results")
    (folder / name).write_text(content)
    with pytest.raises(InputError, match=f"{name}: expected what an evaluation"):
        load_evaluated(folder)


def test_pages_in_the_docs_are_those_of_the_results_beside_them():
    for page in (ROOT / "docs/results").glob("*.md"):
        evaluated = load_evaluated(page.with_suffix(""))
        assert page.read_text() == page_text(evaluated, page.parent)
        for experiment in evaluated.experiments():
            paragraph = evaluated.folder / experiment.name / "paragraph.md"
            assert paragraph.read_text() == experiment.write_up(evaluated.results(experiment)).text
            assert paragraph.with_name(f"{experiment.name}.png").is_file()


def test_the_docs_list_all_experiments():
    page = (ROOT / "docs/evaluation.md").read_text()
    for experiment in EXPERIMENTS.values():
        assert re.search(
            rf"^\| `{experiment.name}` \| .+ \| {experiment.paper} ?\|$", page, re.MULTILINE
        )
