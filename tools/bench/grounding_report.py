"""Tables of how often answers were right, with intervals, one encoder beside the other."""

from collections.abc import Sequence

import numpy as np

from tools.bench.grounding_scenes import GENERAL_KINDS, KINDS
from tools.bench.policies import wilson_interval

MEASURES = ("point", "region", "object")
_GENERAL = "general"


def summarise(records: Sequence[dict]) -> list[dict]:
    """Count right answers.

    Args:
        records: One for each question and encoder, as `tools.bench.grounding` makes them.

    Returns:
        One row for each split, wording, kind and encoder that occurs; the kind "general" holds
        those of `GENERAL_KINDS` together.
    """
    rows = []
    for split in dict.fromkeys(r["split"] for r in records):
        for wording in ("template", "paraphrase"):
            mine = [r for r in records if (r["split"], r["wording"]) == (split, wording)]
            for kind in (*KINDS, _GENERAL):
                rows += _rows(split, wording, kind, mine)
    return rows


def _rows(split: str, wording: str, kind: str, records: Sequence[dict]) -> list[dict]:
    kinds = GENERAL_KINDS if kind == _GENERAL else (kind,)
    chosen = [r for r in records if r["kind"] in kinds]
    return [
        {
            "split": split,
            "wording": wording,
            "kind": kind,
            "encoder": encoder,
            **_counts([r for r in chosen if r["encoder"] == encoder]),
        }
        for encoder in dict.fromkeys(r["encoder"] for r in chosen)
    ]


def _counts(records: Sequence[dict]) -> dict:
    return {
        "goals": len(records),
        "scenes": len({r["seed"] for r in records}),
        "chance_point": float(np.mean([r["chance_point"] for r in records])),
        "chance_object": float(np.mean([r["chance_object"] for r in records])),
        **{measure: sum(r[measure] for r in records) for measure in MEASURES},
    }


def format_tables(rows: Sequence[dict]) -> str:
    """Format a table for each split.

    Args:
        rows: As `summarise` returns them.

    Returns:
        Markdown; shares in per cent with 95 % Wilson intervals.
    """
    splits = dict.fromkeys(row["split"] for row in rows)
    return "\n\n".join(
        _format_split(split, [r for r in rows if r["split"] == split]) for split in splits
    )


def _format_split(split: str, rows: Sequence[dict]) -> str:
    encoders = list(dict.fromkeys(row["encoder"] for row in rows))
    heads = ["point: chance", "object: chance"]
    heads += [f"{measure}: {encoder}" for measure in MEASURES for encoder in encoders]
    lines = [f"| {split} | goals | scenes | {' | '.join(heads)} |"]
    lines.append("| --- |" + " ---: |" * (len(heads) + 2))
    for wording, kind in dict.fromkeys((row["wording"], row["kind"]) for row in rows):
        by_encoder = {r["encoder"]: r for r in rows if (r["wording"], r["kind"]) == (wording, kind)}
        lines.append(_format_row(wording, kind, [by_encoder[name] for name in encoders]))
    return "\n".join(lines)


def _format_row(wording: str, kind: str, rows: Sequence[dict]) -> str:
    first = rows[0]
    cells = [f"{kind}, {wording}", str(first["goals"]), str(first["scenes"])]
    cells += [f"{first[key]:.0%}" for key in ("chance_point", "chance_object")]
    cells += [_share(row[measure], row["goals"]) for measure in MEASURES for row in rows]
    return "| " + " | ".join(cells) + " |"


def _share(right: int, asked: int) -> str:
    low, high = wilson_interval(right, asked)
    return f"{100 * right / asked:.1f} [{100 * low:.0f}, {100 * high:.0f}]"
