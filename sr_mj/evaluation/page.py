"""One HTML page with everything in it: charts, tables, and a section for every arrangement."""

import base64
import html
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from sr_mj.evaluation.charts import Bar, rate_chart, stacked_chart
from sr_mj.evaluation.plan import Episode
from sr_mj.evaluation.published import TABLE_1, TABLE_3, kind_of_policy
from sr_mj.evaluation.results import SNAPSHOTS, Lines, snapshot_path
from sr_mj.evaluation.summary import Group, Score, by_group, by_policy, causes, grouped, score
from sr_mj.evaluation.table import Table, show

_STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; margin: 2em auto; max-width: 1100px; color: #222;
  padding: 0 1em; }
table { border-collapse: collapse; margin: .6em 0 1.6em; font-size: 13px; display: block;
  overflow-x: auto; }
th, td { border-bottom: 1px solid #ddd; padding: .25em .6em; text-align: left; }
th { background: #f4f4f4; position: sticky; top: 0; }
td.number, td.percent, td.points { text-align: right; font-variant-numeric: tabular-nums;
  white-space: nowrap; }
figure { margin: 1em 0; } figcaption { font-weight: 600; } svg { max-width: 100%; height: auto; }
svg text { font: 12px system-ui, sans-serif; } summary { cursor: pointer; padding: .2em 0; }
.pictures { display: flex; flex-wrap: wrap; gap: 8px; }
.pictures figure { margin: 0; font-size: 12px; } .pictures img { width: 330px; max-width: 100%; }
.note { background: #fff6df; padding: .4em .8em; }
"""


def page(
    title: str,
    intro: Sequence[str],
    notes: Sequence[str],
    tables: Sequence[Table],
    lines: Lines,
    pictures: Sequence[Path],
) -> str:
    """Write the page.

    Args:
        title: Heading.
        intro: Paragraphs about what was run.
        notes: What a reader has to be warned of.
        tables: In the order in which they are shown.
        lines: All results, for the charts and the arrangements.
        pictures: Folders that may hold pictures of episodes.

    Returns:
        HTML that needs no other file.
    """
    arranged = _arrangements(lines, pictures)
    if arranged:
        arranged.insert(0, "<h2 id='arrangements'>Arrangements</h2>")
    links = [f'<a href="#{t.name}">{html.escape(t.title)}</a>' for t in tables]
    links += ["<a href='#arrangements'>Arrangements</a>"] if arranged else []
    parts = [
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">',
        f"<title>{html.escape(title)}</title><style>{_STYLE}</style></head><body>",
        f"<h1>{html.escape(title)}</h1>",
        *(f"<p>{html.escape(text)}</p>" for text in intro),
        *(f'<p class="note">{html.escape(text)}</p>' for text in notes),
        f"<p>{' · '.join(links)}</p>",
        *_charts(lines),
        *(table.html() for table in tables),
        *arranged,
        "</body></html>\n",
    ]
    return "\n".join(parts)


def _charts(lines: Lines) -> list[str]:
    charts = []
    for group, records in by_group(lines).items():
        policies = by_policy(records)
        title = f"{group.task}, {group.split} objects, {group.condition}"
        bars = [_bar(group, score(label, own)) for label, own in policies.items()]
        legend = " (diamond: published)" if any(bar.published is not None for bar in bars) else ""
        charts.append(rate_chart(f"{title}: success in per cent{legend}", bars))
        failed = [(label, len(own), causes(own)) for label, own in policies.items()]
        if any(parts for _, _, parts in failed):
            charts.append(stacked_chart(f"{title}: causes of failure", failed))
    return charts


def _bar(group: Group, s: Score) -> Bar:
    published = next(
        (
            entry.seen if group.split == "seen" else entry.unseen
            for entry in (*TABLE_1, *TABLE_3)
            if entry.task == group.task
            and group.condition == "clean"
            and entry.policy == kind_of_policy(s.policy)
        ),
        None,
    )
    return Bar(
        label=s.title,
        rate=s.success,
        published=None if published is None else published / 100,
        is_privileged=s.is_privileged,
    )


def _arrangements(lines: Lines, pictures: Sequence[Path]) -> list[str]:
    fixed = [r for r in lines.values() if r["arrangement_sha256"] is not None]
    return [
        _arrangement(scene, condition, records, pictures)
        for (scene, condition), records in sorted(
            grouped(fixed, lambda r: (str(r["scene"]), str(r["condition"]))).items()
        )
    ]


def _arrangement(
    scene: str, condition: str, records: list[dict[str, Any]], pictures: Sequence[Path]
) -> str:
    about = next((r for r in records if "goal" in r), None)
    policies = by_policy(records)
    rows = []
    for label, own in policies.items():
        s = score(label, own)
        why = ", ".join(f"{cause} {count}" for cause, count in causes(own))
        rows.append(
            f"<tr><td>{html.escape(s.title)}</td><td>{round(s.success.value * s.runs)} of {s.runs}"
            f"</td><td>{show(s.steps, 'number')}</td><td>{html.escape(why)}</td></tr>"
        )
    heading = scene if condition == "clean" else f"{scene}, {condition}"
    goal = "" if about is None else f": {about['goal']}"
    told = ""
    if about is not None:
        told = (
            f"Targets {', '.join(about['targets'])}. "
            + (f"To be put {about['relation']} " if about["relation"] else "")
            + (f"{' or '.join(about['references'])}. " if about["relation"] else "")
            + f"Objects {', '.join(about['objects'])}."
        )
    return (
        f"<details><summary>{html.escape(heading + goal)}</summary>\n<p>{html.escape(told)}</p>\n"
        "<table><thead><tr><th>policy</th><th>success</th><th>steps</th><th>failures</th></tr>"
        f"</thead><tbody>{''.join(rows)}</tbody></table>\n{_pictures(policies, pictures)}</details>"
    )


def _pictures(policies: dict[str, list[dict[str, Any]]], folders: Sequence[Path]) -> str:
    """Show the first view once, and choice and outcome of every policy."""
    figures: list[str] = []
    for records in policies.values():
        for record in records:
            episode = Episode.of_record(record)
            for name in SNAPSHOTS:
                if name == "view" and figures:
                    continue
                found = (snapshot_path(folder / episode.key, name) for folder in folders)
                path = next((path for path in found if path.is_file()), None)
                if path is not None:
                    figures.append(_figure(path, _caption(record, name)))
    return f'<div class="pictures">{"".join(figures)}</div>' if figures else ""


def _caption(record: dict[str, Any], name: str) -> str:
    if name == "view":
        return f"First view, seed {record['seed']}"
    if name == "choice":
        return f"{record['policy']}: first choice"
    return f"{record['policy']}: {'success' if record['success'] else record['cause']}"


def _figure(path: Path, caption: str) -> str:
    data = base64.b64encode(path.read_bytes()).decode()
    return (
        f'<figure><img loading="lazy" alt="{html.escape(caption)}" '
        f'src="data:image/jpeg;base64,{data}"><br>{html.escape(caption)}</figure>'
    )
