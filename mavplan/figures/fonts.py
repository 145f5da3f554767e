"""The fonts for names on pictures: what is installed beside matplotlib's own, and names that none of them can draw.

Names are cut to a bounded width, so that none runs across a map.
"""

import functools
import unicodedata
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from mavplan.errors import Problem

MOST_COLUMNS = 26
"""Width of a name in columns of a terminal: a Chinese character takes two."""

OWN = "DejaVu Sans"
"""Comes with matplotlib."""

FALLBACKS = (
    "Noto Sans CJK SC",
    "Noto Sans CJK JP",
    "Noto Sans CJK TC",
    "Noto Sans CJK KR",
    "Noto Sans SC",
    "Noto Sans JP",
    "Source Han Sans",
    "WenQuanYi Zen Hei",
    "WenQuanYi Micro Hei",
    "Droid Sans Fallback",
    "IPAGothic",
    "IPAexGothic",
    "TakaoGothic",
    "VL Gothic",
    "NanumGothic",
    "AR PL UMing CN",
    "Microsoft YaHei",
    "SimHei",
    "Yu Gothic",
    "MS Gothic",
    "Malgun Gothic",
    "PingFang SC",
    "Hiragino Sans",
    "Heiti SC",
    "Apple SD Gothic Neo",
    "Arial Unicode MS",
    "Unifont",
)
"""Families with Chinese, Japanese or Korean, in the order in which they are tried."""

OTHERS = ("Noto Sans ", "FreeSans", "Lohit ", "Segoe UI")
"""How the names of families begin that are tried next, for other scripts."""

MOST_NAMED = 5
"""Names in one sentence."""


@functools.cache
def families() -> tuple[str, ...]:
    """Return the installed families in which names are drawn, in the order in which they are tried."""
    from matplotlib.font_manager import fontManager

    installed = {entry.name for entry in fontManager.ttflist}
    others = sorted(name for name in installed if name.startswith(OTHERS) and name not in FALLBACKS)
    return (OWN, *(name for name in FALLBACKS if name in installed), *others)


def families_for(text: str) -> list[str]:
    """Return the families that a text takes: matplotlib's own, and those with what it lacks."""
    taken = [OWN]
    lacking = set(text) - _characters(OWN)
    for family in families()[1:]:
        if not lacking:
            break
        if found := lacking & _characters(family):
            taken.append(family)
            lacking -= found
    return taken


def drawable(text: str) -> bool:
    """Return whether the fonts here have every character of a text."""
    return all(any(char in _characters(family) for family in families_for(text)) for char in set(text))


@contextmanager
def quiet() -> Iterator[None]:
    """Keep matplotlib's words about fonts from the terminal: what concerns names is told by `undrawable`.

    A fallback font that comes in one weight only is told of each time; a cluster of marks may lack a glyph although
    some font has every character of it.
    """
    import logging
    import warnings

    logger = logging.getLogger("matplotlib.font_manager")
    level = logger.level
    logger.setLevel(logging.ERROR)
    try:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "Glyph .* missing from", UserWarning)
            yield
    finally:
        logger.setLevel(level)


@functools.cache
def _characters(family: str) -> frozenset[str]:
    """Return what a family has glyphs for; of one that cannot be read, nothing."""
    from matplotlib.font_manager import FontProperties, findfont, get_font

    try:
        with quiet():
            font = get_font(findfont(FontProperties(family=family), fallback_to_default=False))
        return frozenset(map(chr, font.get_charmap()))
    except (ValueError, OSError, RuntimeError):
        return frozenset()


def shown_name(name: str, number: int) -> str:
    """Return a name as a picture has it: on one line, cut to `MOST_COLUMNS`; ``#6`` where no font can draw it.

    Parameters
    ----------
    name
        As its file has it.
    number
        Its place in the plan's list of users, from 1.
    """
    text = _one_line(name)
    return shortened(text) if drawable(text) else f"#{number}"


def shortened(text: str) -> str:
    """Return a text of at most `MOST_COLUMNS`, with an ellipsis where it was cut."""
    if sum(map(_columns, text)) <= MOST_COLUMNS:
        return text
    left, kept = MOST_COLUMNS - 1, ""
    for char in text:
        left -= _columns(char)
        if left < 0:
            break
        kept += char
    return kept.rstrip() + "…"


def undrawable(names: Sequence[str]) -> tuple[Problem, ...]:
    """Return one warning that says which names no font here can draw; none where all can be drawn."""
    found = [name for name in dict.fromkeys(names) if not drawable(_one_line(name))]
    if not found:
        return ()
    named = ", ".join(shortened(_one_line(name)) for name in found[:MOST_NAMED])
    more = f" and {len(found) - MOST_NAMED} more" if len(found) > MOST_NAMED else ""
    message = (
        f"the fonts here cannot draw {named}{more}: the picture has numbers in their place, #3 for "
        "the plan's third user; install a font that has them, for instance Noto Sans CJK"
    )
    return (Problem("", message, "no-glyphs", "warning"),)


def _one_line(text: str) -> str:
    """Return a text without new lines, control and format characters, which have no glyph and need none."""
    spaced = " ".join(text.split())
    return "".join(char for char in spaced if unicodedata.category(char) not in {"Cc", "Cf", "Cs"})


def _columns(char: str) -> int:
    if unicodedata.combining(char):
        return 0
    return 2 if unicodedata.east_asian_width(char) in "WF" else 1
