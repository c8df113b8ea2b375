"""Charts as SVG text, to be put into a page."""

import html
from collections.abc import Sequence
from dataclasses import dataclass

from sr_mj.evaluation.statistics import Interval

_LABEL_PX, _BAR_PX, _ROW_PX, _VALUE_PX, _AXIS_PX = 210, 420, 24, 190, 22
_WIDTH_PX = _LABEL_PX + _BAR_PX + _VALUE_PX
_PLAIN, _PRIVILEGED = "#3b6ea5", "#b9b9b9"
_COLORS = (
    *("#c44e52", "#dd8452", "#ccb974", "#8172b3", "#937860", "#64b5cd"),
    *("#55a868", "#da8bc3", "#8c8c8c", "#4c72b0", "#a83279", "#2f4b3c"),
)


@dataclass(frozen=True, kw_only=True)
class Bar:
    """One bar of a chart of rates.

    Attributes:
        label: What it is the rate of.
        rate: The rate, 0 to 1, with its interval.
        published: The same as published by others, 0 to 1; None if nobody did.
        is_privileged: Drawn in grey.
    """

    label: str
    rate: Interval
    published: float | None = None
    is_privileged: bool = False


def rate_chart(title: str, bars: Sequence[Bar]) -> str:
    """Draw rates as bars with their intervals; a diamond marks a published figure.

    Args:
        title: Heading.
        bars: From top to bottom.

    Returns:
        An `svg` element.
    """
    parts = []
    for row, bar in enumerate(bars):
        top = _AXIS_PX + row * _ROW_PX
        middle = top + _ROW_PX / 2
        low, value, high = (_x(v) for v in (bar.rate.low, bar.rate.value, bar.rate.high))
        color = _PRIVILEGED if bar.is_privileged else _PLAIN
        parts += [
            _label(bar.label, middle),
            f'<rect x="{_LABEL_PX}" y="{top + 4}" width="{value - _LABEL_PX:.1f}" '
            f'height="{_ROW_PX - 8}" fill="{color}"/>',
            f'<path d="M{low:.1f} {middle}H{high:.1f}M{low:.1f} {middle - 4}v8'
            f'M{high:.1f} {middle - 4}v8" stroke="#111" fill="none"/>',
        ]
        text = f"{bar.rate.value * 100:.1f} % [{bar.rate.low * 100:.0f}, {bar.rate.high * 100:.0f}]"
        if bar.published is not None:
            x = _x(bar.published)
            parts.append(
                f'<path d="M{x:.1f} {middle - 6}l5 6l-5 6l-5 -6z" fill="#fff" stroke="#c44e52" '
                f'stroke-width="2"/>'
            )
            text += f", paper {bar.published * 100:.1f}"
        parts.append(_value(text, middle))
    return _svg(title, parts, len(bars))


def stacked_chart(title: str, rows: Sequence[tuple[str, int, Sequence[tuple[str, int]]]]) -> str:
    """Draw counts as parts of a whole.

    Args:
        title: Heading.
        rows: Label, whole, and the parts by name.

    Returns:
        An `svg` element with its legend.
    """
    names = list(dict.fromkeys(name for _, _, counts in rows for name, _ in counts))
    color = {name: _COLORS[i % len(_COLORS)] for i, name in enumerate(names)}
    parts = []
    for row, (label, whole, counts) in enumerate(rows):
        top = _AXIS_PX + row * _ROW_PX
        parts.append(_label(label, top + _ROW_PX / 2))
        x = float(_LABEL_PX)
        for name, count in sorted(counts, key=lambda part: names.index(part[0])):
            width = count / whole * _BAR_PX
            parts.append(
                f'<rect x="{x:.1f}" y="{top + 4}" width="{width:.1f}" height="{_ROW_PX - 8}" '
                f'fill="{color[name]}"><title>{html.escape(name)}: {count}</title></rect>'
            )
            x += width
        failed = sum(count for _, count in counts)
        parts.append(_value(f"{failed} of {whole} failed", top + _ROW_PX / 2))
    for i, name in enumerate(names):
        x, y = _LABEL_PX + (i % 3) * 210, _AXIS_PX + len(rows) * _ROW_PX + 18 + i // 3 * 18
        parts.append(
            f'<rect x="{x}" y="{y - 10}" width="12" height="12" fill="{color[name]}"/>'
            f'<text x="{x + 17}" y="{y}">{html.escape(name)}</text>'
        )
    return _svg(title, parts, len(rows), extra_px=18 * (-(-len(names) // 3)) + 12)


def _x(rate: float) -> float:
    return _LABEL_PX + _BAR_PX * rate


def _label(text: str, middle: float) -> str:
    return (
        f'<text x="{_LABEL_PX - 8}" y="{middle + 4}" text-anchor="end">{html.escape(text)}</text>'
    )


def _value(text: str, middle: float) -> str:
    return f'<text x="{_LABEL_PX + _BAR_PX + 10}" y="{middle + 4}">{html.escape(text)}</text>'


def _svg(title: str, parts: list[str], num_rows: int, extra_px: int = 0) -> str:
    bottom = _AXIS_PX + num_rows * _ROW_PX
    grid = "".join(
        f'<path d="M{_x(share)} {_AXIS_PX}V{bottom}" stroke="#ddd"/>'
        f'<text x="{_x(share)}" y="{_AXIS_PX - 6}" text-anchor="middle" fill="#777">'
        f"{share * 100:.0f}</text>"
        for share in (0, 0.25, 0.5, 0.75, 1)
    )
    height = bottom + extra_px + 6
    return (
        f"<figure><figcaption>{html.escape(title)}</figcaption>"
        f'<svg viewBox="0 0 {_WIDTH_PX} {height}" width="{_WIDTH_PX}" height="{height}" '
        f'role="img" aria-label="{html.escape(title)}">{grid}{"".join(parts)}</svg></figure>\n'
    )
