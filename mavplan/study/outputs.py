"""The files of a finished study: its rows and its table as CSV, the rows as Parquet too, and the pictures."""

import csv
import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from mavplan.errors import InputError
from mavplan.formats.atomic import write_all
from mavplan.study.cases import Row
from mavplan.study.settings import Settings
from mavplan.study.store import COLUMNS, row_values
from mavplan.study.summary import Line, flat

ROWS_CSV, ROWS_PARQUET, SUMMARY_CSV = "study.csv", "study.parquet", "summary.csv"


def write_outputs(
    folder: Path,
    settings: Settings,
    rows: Sequence[Row],
    lines: Sequence[Line],
    *,
    parquet: bool = False,
    pictures: str | None = None,
) -> list[Path]:
    """Write the files of a study into its folder, all or none, and return their paths.

    Parameters
    ----------
    rows, lines
        Sorted by case; and their `summarise`.
    parquet
        Whether to write ``study.parquet`` beside ``study.csv``.
    pictures
        ``png``, ``svg`` or ``pdf``: draw the pictures too.

    Raises
    ------
    InputError
        A package is missing, or the folder cannot be written.
    """
    tables = [row_values(row) for row in rows]
    contents: dict[Path, str | bytes] = {
        folder / ROWS_CSV: csv_text(tables, COLUMNS),
        folder / SUMMARY_CSV: csv_text([flat(line) for line in lines], tuple(flat(lines[0]))),
    }
    if parquet:
        contents[folder / ROWS_PARQUET] = parquet_bytes(tables)
    if pictures is not None:
        from mavplan.figures.study import render_study

        for name, content in render_study(lines, settings, pictures).items():
            contents[folder / name] = content
    write_all(contents.items())
    return list(contents)


def csv_text(tables: Sequence[dict[str, Any]], columns: Sequence[str]) -> str:
    """Return CSV with a header; floats to the last bit, nothing where there is no value."""
    out = io.StringIO()
    writer = csv.DictWriter(out, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows(tables)
    return out.getvalue()


def parquet_bytes(tables: Sequence[dict[str, Any]]) -> bytes:
    """Return the tables as Parquet, a column a key.

    Raises
    ------
    InputError
        pyarrow is not installed.
    """
    check_parquet()
    import pyarrow as pa
    from pyarrow import parquet

    out = io.BytesIO()
    parquet.write_table(pa.Table.from_pylist(list(tables)), out)
    return out.getvalue()


def check_parquet() -> None:
    """Raise an `InputError` where Parquet cannot be written, before any work is done."""
    try:
        import pyarrow.parquet  # noqa: F401
    except ImportError as error:
        raise InputError("Parquet needs pyarrow: pip install 'mavplan[study]'") from error
