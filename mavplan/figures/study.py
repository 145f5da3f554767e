"""Pictures of a study: its figures over λ, after the paper's figures 8 and 9, and over whatever else was varied.

Assumed, as our copy of the paper has lost its pictures: figure 8 shows trajectory length and sum throughput over λ,
both normalised by SBW's; figure 9 shows the joint evaluation index ρ_e over λ.
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
    names = list(dict.fromkeys(line.planner for line in lines))
    for number, name in enumerate(names):
        other = OTHER_COLOURS[number % len(OTHER_COLOURS)], OTHER_MARKERS[number % len(OTHER_MARKERS)]
        colour, marker = STYLES.get(name, other)
        points: list[tuple[float, Interval]] = [
            (getattr(line, axis), getattr(line, quantity))
            for line in lines
            if line.planner == name and getattr(line, quantity) is not None
        ]
        places = [place for place, _ in points]
        ax.plot(
            places, [found.value for _, found in points], color=colour, marker=marker, markersize=5,
            linewidth=1.4, label=name.upper(),
        )  # fmt: skip
        ends = [
            (place, found.low, found.high)
            for place, found in points
            if found.low is not None and found.high is not None
        ]
        if len(ends) == 1:  # a band over one place has no width
            place, low, high = ends[0]
            ax.vlines(place, low, high, color=colour, linewidth=4, alpha=0.25)
        elif ends:
            where, low_ends, high_ends = zip(*ends, strict=True)
            ax.fill_between(where, low_ends, high_ends, color=colour, alpha=0.18, linewidth=0)
    ax.set_xticks(sorted({getattr(line, axis) for line in lines}))
    ax.set_xlabel(AXIS_LABELS[axis])
    ax.set_ylabel(QUANTITY_LABELS[quantity])
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
        "figure-9": ("mean_users", ("rho_e",)),
    }
    for axis, name in (
        ("snr_threshold_db", "threshold"),
        ("clusters", "clusters"),
        ("altitude_m", "altitude"),
    ):
        if len(getattr(settings, axis)) > 1:
            wanted[f"sweep-{name}"] = (axis, tuple(QUANTITY_LABELS))
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

    figure = Figure(figsize=(4.4 * len(quantities) + 0.4, 4.2), layout="constrained")
    panels = figure.subplots(1, len(quantities), squeeze=False)[0]
    for ax, quantity in zip(panels, quantities, strict=True):
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
