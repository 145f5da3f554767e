"""Users from CSV: a header line, then a user a line; comma, semicolon or tab as the header shows."""

import csv
import io

from mavplan.scenario.report import Report
from mavplan.scenario.table import Row, Table, is_usable_header

_DELIMITERS = ",;\t"
_COMMA_HINT = "; numbers take a decimal point, and a name with a comma stands in quotes"


def read_csv(text: str, label: str, report: Report) -> Table | None:
    """Return the rows of a CSV file, or None where it has no usable header.

    Blank lines are skipped. A line with more or fewer cells than the header is a problem: in a line that lacks one,
    no cell can be trusted to stand below its name.

    Parameters
    ----------
    text
        Content of the file.
    label
        What to call it in problems.
    report
        Takes the problems.
    """
    delimiter = _delimiter_of(text)
    reader = csv.reader(
        io.StringIO(text, newline=""), delimiter=delimiter, skipinitialspace=True, strict=True
    )
    header: tuple[str, ...] | None = None
    rows: list[Row] = []
    line = 1
    try:
        for cells in reader:
            first_line, line = line, reader.line_num + 1
            place = f"{label}, line {first_line:,}"
            if not any(cell.strip() for cell in cells):
                continue
            if header is None:
                header = tuple(cell.strip() for cell in cells)
                if not is_usable_header(header, place, report):
                    return None
            elif len(cells) != len(header):
                hint = _COMMA_HINT if len(cells) > len(header) and delimiter == "," else ""
                message = f"found {len(cells)} cells; the header has {len(header)} columns{hint}"
                report.error(place, message, "cell-count")
            else:
                rows.append(Row(first_line, dict(zip(header, cells, strict=True))))
    except csv.Error as error:
        report.error(f"{label}, line {line:,}", f"is not valid CSV: {error}", "syntax")
    else:
        if header is None:
            report.error(label, "is empty; a header line and a user a line are expected", "empty")
    return None if header is None else Table(label, "line", "column", header, rows)


def _delimiter_of(text: str) -> str:
    """Return the delimiter that cuts the first line with anything on it into most cells; of equals, the comma."""
    first = next((line for line in io.StringIO(text, newline="") if line.strip()), "")
    return max(_DELIMITERS, key=lambda delimiter: len(_split(first, delimiter)))


def _split(line: str, delimiter: str) -> list[str]:
    try:
        return next(csv.reader([line], delimiter=delimiter, skipinitialspace=True), [])
    except csv.Error:
        return []
