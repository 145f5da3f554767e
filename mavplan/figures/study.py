"""Pictures of a study: its figures over λ, after the paper's figures 8 and 9, and over whatever else was varied.

Assumed, as our copy of the paper has lost its pictures: figure 8 shows trajectory length and sum throughput over λ,
both normalised by SBW's; figure 9 shows the joint evaluation index ρ_e over λ. Ours adds how far each planner's ρ_e
lies above the next one's, with the far narrower interval of a paired difference.
"""

import io
from collections.abc import Sequence
from typing import TYPE_CHECKING

from mavplan.errors import InputError
from mavplan.study import regime
from mavplan.study.intervals import Interval
from mavplan.study.settings import Settings, as_text
from mavplan.study.summary import Line

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Okabe and Ito's palette: told apart by colour-blind eyes; the markers tell them apart in grey.
STYLES = {
    "tloaik": ("#0072B2", "o"),
    "stoaik": ("#D55E00", "s"),
    "boaik": ("#009E73", "D"),
    "sbw": ("#000000", "x"),
}
OTHER_COLOURS, OTHER_MARKERS = ("#CC79A7", "#E69F00", "#56B4E9"), "^v*P"

AXIS_LABELS = {
    "mean_users": "λ: mean users in the square",
    "clusters": "K: clusters",
    "altitude_m": "H: altitude [m]",
    "snr_threshold_db": "γ_th: SNR threshold [dB]",
}
"""What can be varied, and what stands under the axis."""

QUANTITY_LABELS = {
    "length": "trajectory length / SBW's",
    "sum_rate": "sum throughput / SBW's",
    "rho_e": "joint evaluation index ρ_e",
}
"""Estimates of a `Line`, and what stands beside the axis."""

DIFFERENCES = "differences"
"""The panel of `draw_differences`."""

REGIME = {
    "mean_users": regime.MEAN_USERS[len(regime.MEAN_USERS) // 2],
    "clusters": regime.CLUSTERS,
    "altitude_m": regime.ALTITUDE_M,
    "snr_threshold_db": regime.SNR_THRESHOLD_DB,
}


def draw_curves(ax: "Axes", lines: Sequence[Line], axis: str, quantity: str) -> "Axes":
    """Draw a quantity over one of the varied values: a curve for each planner, its 95 % interval as a band.

    Parameters
    ----------
    ax
        Where to draw.
    lines
        Of one setting but for ``axis``, as `slice_of` gives them.
    axis
        One of `AXIS_LABELS`.
    quantity
        One of `QUANTITY_LABELS`.
    """
    for name, own in _by_planner(lines).items():
        _draw_curve(ax, name, name.upper(), [(getattr(line, axis), getattr(line, quantity)) for line in own])
    return _label(ax, lines, axis, QUANTITY_LABELS[quantity])


def draw_differences(ax: "Axes", lines: Sequence[Line], axis: str) -> "Axes":
    """Draw how far each planner's ρ_e lies above that of the next in the published order, on the same draws.

    Above zero the two stand in the published order. The difference to SBW, far above all, is left out.
    """
    for name, own in _by_planner(lines).items():
        less = own[0].less
        if less is not None and less != regime.BENCHMARK:
            points = [(getattr(line, axis), line.rho_e_difference) for line in own]
            _draw_curve(ax, name, f"{name.upper()} − {less.upper()}", points)
    ax.axhline(0.0, color="0.3", linewidth=0.9, linestyle="--", zorder=1)
    if ax.get_legend_handles_labels()[0]:
        ax.legend(frameon=False, fontsize=8)
    return _label(ax, lines, axis, "paired difference of ρ_e")


def _by_planner(lines: Sequence[Line]) -> dict[str, list[Line]]:
    """Return the lines of each planner."""
    found: dict[str, list[Line]] = {}
    for line in lines:
        found.setdefault(line.planner, []).append(line)
    return found


def _draw_curve(
    ax: "Axes", planner: str, label: str, points: Sequence[tuple[float, Interval | None]]
) -> None:
    """Draw estimates in their planner's style, and their intervals as a band."""
    number = len(ax.get_lines())
    other = OTHER_COLOURS[number % len(OTHER_COLOURS)], OTHER_MARKERS[number % len(OTHER_MARKERS)]
    colour, marker = STYLES.get(planner, other)
    known = [(place, found) for place, found in points if found is not None]
    ax.plot(
        [place for place, _ in known], [found.value for _, found in known], color=colour, marker=marker,
        markersize=5, linewidth=1.4, label=label,
    )  # fmt: skip
    ends = [
        (place, found.low, found.high)
        for place, found in known
        if found.low is not None and found.high is not None
    ]
    if len(ends) == 1:  # a band over one place has no width
        place, low, high = ends[0]
        ax.vlines(place, low, high, color=colour, linewidth=4, alpha=0.25)
    elif ends:
        where, low_ends, high_ends = zip(*ends, strict=True)
        ax.fill_between(where, low_ends, high_ends, color=colour, alpha=0.18, linewidth=0)


def _label(ax: "Axes", lines: Sequence[Line], axis: str, quantity_label: str) -> "Axes":
    ax.set_xticks(sorted({getattr(line, axis) for line in lines}))
    ax.set_xlabel(AXIS_LABELS[axis])
    ax.set_ylabel(quantity_label)
    ax.grid(color="0.9", linewidth=0.6)
    ax.set_axisbelow(True)
    return ax


def slice_of(lines: Sequence[Line], axis: str) -> list[Line]:
    """Return the lines over one axis, all else held: at the regime's value, or the least where it is not there."""
    kept = list(lines)
    for other in AXIS_LABELS:
        if other != axis:
            there = {getattr(line, other) for line in kept}
            held = REGIME[other] if REGIME[other] in there else min(there)
            kept = [line for line in kept if getattr(line, other) == held]
    return sorted(kept, key=lambda line: float(getattr(line, axis)))


def render_study(lines: Sequence[Line], settings: Settings, file_format: str) -> dict[str, bytes]:
    """Return the pictures of a study by file name: figures 8 and 9, and one for everything else that was varied.

    Parameters
    ----------
    lines
        The table of the study.
    settings
        What was varied.
    file_format
        ``png``, ``svg`` or ``pdf``.

    Raises
    ------
    InputError
        matplotlib is not installed.
    """
    wanted: dict[str, tuple[str, tuple[str, ...]]] = {
        "figure-8": ("mean_users", ("length", "sum_rate")),
        "figure-9": ("mean_users", ("rho_e", DIFFERENCES)),
    }
    for axis, name in (
        ("snr_threshold_db", "threshold"),
        ("clusters", "clusters"),
        ("altitude_m", "altitude"),
    ):
        if len(getattr(settings, axis)) > 1:
            wanted[f"sweep-{name}"] = (axis, (*QUANTITY_LABELS, DIFFERENCES))
    return {
        f"{name}.{file_format}": _render(slice_of(lines, axis), axis, quantities, settings, file_format)
        for name, (axis, quantities) in wanted.items()
    }


def check_matplotlib() -> None:
    """Raise an `InputError` where no picture can be drawn, before any work is done."""
    try:
        import matplotlib.figure  # noqa: F401
    except ImportError as error:
        raise InputError("pictures need matplotlib: pip install 'mavplan[figures]'") from error


def _render(
    lines: Sequence[Line], axis: str, quantities: Sequence[str], settings: Settings, file_format: str
) -> bytes:
    """Return one picture: a panel for each quantity over one axis."""
    check_matplotlib()
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    rows = len(quantities) // 2  # two panels side by side
    figure = Figure(figsize=(9.2, 3.6 * rows + 0.8), layout="constrained")
    panels = figure.subplots(rows, 2).ravel()
    for ax, quantity in zip(panels, quantities, strict=True):
        if quantity == DIFFERENCES:
            draw_differences(ax, lines, axis)
        else:
            draw_curves(ax, lines, axis, quantity)
    figure.suptitle(_title(lines, axis, settings), fontsize=9)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), frameon=False, fontsize=8)
    content = io.BytesIO()
    # Nothing of the day or of chance inside: the same study is the same file.
    metadata = {"png": {}, "svg": {"Date": None}, "pdf": {"CreationDate": None}}[file_format]
    with rc_context({"svg.hashsalt": "mavplan"}):
        figure.savefig(content, format=file_format, dpi=150, metadata=metadata)
    return content.getvalue()


def _title(lines: Sequence[Line], axis: str, settings: Settings) -> str:
    """Return what was held, and over how many draws."""
    first = lines[0]
    symbols = {"mean_users": "λ", "clusters": "K", "altitude_m": "H", "snr_threshold_db": "γ_th"}
    units = {"altitude_m": " m", "snr_threshold_db": " dB"}
    held = [
        f"{symbol} {as_text(getattr(first, name))}{units.get(name, '')}"
        for name, symbol in symbols.items()
        if name != axis
    ]
    held.append(f"R {regime.RADIUS_M:.0f} m" if settings.held == "radius" else "transmit power held")
    drawn = "users in pairs" if settings.generator == "pairs" else "single users"
    return f"{', '.join(held)}; {first.cases:,} draws of {drawn}, 95 % intervals"
