"""Users from a spreadsheet (XLSX): a header row, then a user a row, on the first sheet that has cells."""

import datetime
import io
from collections.abc import Sequence

from mavplan.scenario.report import Report, listed
from mavplan.scenario.table import Row, Table, is_usable_header


def read_xlsx(data: bytes, label: str, report: Report) -> Table | None:
    """Return the rows of the first sheet that has cells, or None where it has no usable header.

    Cells hold what the program that wrote the file has calculated; formulas are not run. Empty rows are skipped.

    Parameters
    ----------
    data
        Content of the file; its size when unpacked has been looked at already.
    label
        What to call it in problems.
    report
        Takes the problems.
    """
    import python_calamine

    try:
        workbook = python_calamine.load_workbook(io.BytesIO(data))
        sheets = {
            name: workbook.get_sheet_by_name(name).to_python(skip_empty_area=False)
            for name in _shown(workbook)
        }
    except (python_calamine.CalamineError, ValueError, OSError) as error:
        report.error(label, f"is not XLSX that can be read: {_on_one_line(error)}", "syntax")
        return None
    filled = {name: rows for name, rows in sheets.items() if any(_is_filled(row) for row in rows)}
    if not filled:
        report.error(label, "is empty; a header row and a user a row are expected", "empty")
        return None
    sheet, grid = next(iter(filled.items()))
    if len(filled) > 1:
        message = (
            f"only its first sheet is read, {listed([sheet])}; the others are {listed(list(filled)[1:], 5)}"
        )
        report.warning(label, message, "not-used")
    numbered = [(number, row) for number, row in enumerate(grid, start=1) if _is_filled(row)]
    first, cells = numbered[0]
    header = tuple(str(cell).strip() for cell in cells)
    if not is_usable_header(header, f"{label}, row {first:,}", report):
        return None
    rows = [
        Row(number, {name: _value(cell) for name, cell in zip(header, row, strict=False) if name})
        for number, row in numbered[1:]
    ]
    return Table(label, "row", "column", header, rows)


def _shown(workbook: object) -> list[str]:
    """Return the names of the sheets that a person sees."""
    from python_calamine import SheetTypeEnum, SheetVisibleEnum

    return [
        sheet.name
        for sheet in workbook.sheets_metadata  # type: ignore[attr-defined]
        if sheet.visible == SheetVisibleEnum.Visible and sheet.typ == SheetTypeEnum.WorkSheet
    ]


def _is_filled(row: Sequence[object]) -> bool:
    return any(cell != "" and not (isinstance(cell, str) and not cell.strip()) for cell in row)


def _value(cell: object) -> object:
    """Return a cell as the other formats have it; a date is the text it reads as."""
    if isinstance(cell, datetime.date | datetime.time | datetime.timedelta):
        return str(cell)
    return cell


def _on_one_line(error: Exception) -> str:
    return " ".join(str(error).split())
