"""A table of results, and how it is written as markdown, CSV and HTML."""

import csv
import html
import io
from dataclasses import dataclass
from typing import Literal

from sr_mj.evaluation.statistics import Interval

Cell = str | int | float | Interval | None
Style = Literal["text", "percent", "points", "number"]


@dataclass(frozen=True, kw_only=True)
class Column:
    """A column.

    Attributes:
        name: Heading.
        style: How numbers are shown to people: "percent" and "points" (percentage points, with a
            sign) are stored as fractions.
    """

    name: str
    style: Style = "text"


@dataclass(frozen=True, kw_only=True)
class Table:
    """Rows of values.

    Attributes:
        name: Name of its CSV file.
        title: Heading.
        note: What one has to know to read it.
        columns: One for each value of a row.
        rows: The values; intervals are an estimate with its ends.
    """

    name: str
    title: str
    note: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[Cell, ...], ...]

    def shown(self) -> tuple[tuple[str, ...], ...]:
        """Return the rows as people read them."""
        return tuple(
            tuple(show(cell, column.style) for cell, column in zip(row, self.columns, strict=True))
            for row in self.rows
        )

    def markdown(self) -> str:
        """Return heading, note and rows as markdown."""
        heading = [column.name for column in self.columns]
        rule = ["---" if column.style == "text" else "--:" for column in self.columns]
        rows = [[text.replace("|", "\\|") for text in row] for row in self.shown()]
        lines = [f"| {' | '.join(cells)} |" for cells in (heading, rule, *rows)]
        return "\n".join([f"## {self.title}", "", self.note, "", *lines]) + "\n"

    def csv(self) -> str:
        """Return the rows as comma-separated values: plain numbers, intervals in three columns."""
        is_interval = [
            any(isinstance(row[i], Interval) for row in self.rows) for i in range(len(self.columns))
        ]
        heading: list[str] = []
        for column, has_ends in zip(self.columns, is_interval, strict=True):
            name = column.name.replace(" ", "_")
            heading += [name, f"{name}_low", f"{name}_high"] if has_ends else [name]
        file = io.StringIO()
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(heading)
        for row in self.rows:
            writer.writerow(
                value
                for cell, has_ends in zip(row, is_interval, strict=True)
                for value in _csv_values(cell, has_ends)
            )
        return file.getvalue()

    def html(self) -> str:
        """Return heading, note and rows as HTML."""
        heading = "".join(f"<th>{html.escape(column.name)}</th>" for column in self.columns)
        rows = "\n".join(
            "<tr>"
            + "".join(
                f'<td class="{column.style}">{html.escape(text)}</td>'
                for text, column in zip(row, self.columns, strict=True)
            )
            + "</tr>"
            for row in self.shown()
        )
        return (
            f'<h2 id="{self.name}">{html.escape(self.title)}</h2>\n'
            f"<p>{html.escape(self.note)}</p>\n"
            f"<table><thead><tr>{heading}</tr></thead>\n<tbody>\n{rows}\n</tbody></table>\n"
        )


def show(cell: Cell, style: Style) -> str:
    """Return a value as people read it; an empty text for None."""
    if cell is None:
        return ""
    if isinstance(cell, str):
        return cell
    if isinstance(cell, Interval):
        ends = f"{show(cell.low, style)}, {show(cell.high, style)}"
        return f"{show(cell.value, style)} [{ends}]"
    if style == "percent":
        return f"{cell * 100:.1f}"
    if style == "points":
        return f"{cell * 100:+.1f}"
    return str(cell) if isinstance(cell, int) else f"{cell:.2f}"


def _csv_values(cell: Cell, has_ends: bool) -> tuple[Cell, ...]:
    if isinstance(cell, Interval):
        return cell.value, cell.low, cell.high
    return (cell, None, None) if has_ends else (cell,)
