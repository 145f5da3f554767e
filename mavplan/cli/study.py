"""``mavplan study``: the planners on many random draws of users; a table, files and pictures."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from mavplan.cli.worker_options import worker_options

if TYPE_CHECKING:
    from mavplan.study.intervals import Interval
    from mavplan.study.settings import Settings
    from mavplan.study.summary import Line


class Listed(click.ParamType[tuple[Any, ...]]):
    """Values between commas."""

    def __init__(self, kind: Callable[[str], Any], name: str, allowed: str) -> None:
        self.kind = kind
        self.name = name
        self.allowed = allowed

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[Any, ...]:
        """Return the values."""
        if isinstance(value, tuple):
            return value
        try:
            return tuple(self.kind(part.strip()) for part in value.split(","))
        except ValueError:
            self.fail(f"{value!r} is not {self.allowed}", param, ctx)


class Seeds(click.ParamType[tuple[int, ...]]):
    """A number of seeds, or ranges of them."""

    name = "SEEDS"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[int, ...]:
        """Return the seeds."""
        from mavplan.study.settings import seeds_of

        if isinstance(value, tuple):
            return value
        try:
            return seeds_of(value)
        except ValueError as error:
            self.fail(str(error), param, ctx)


NUMBERS = Listed(float, "NUMBERS", "a list of numbers, 15,16,20")
WHOLE_NUMBERS = Listed(int, "NUMBERS", "a list of whole numbers, 4,5")
NAMES = Listed(str, "NAMES", "a list of names, tloaik,sbw")


@click.command("study", short_help="Compare the planners on many random draws of users.")
@click.option(
    "-o", "--output", "folder", default="study", show_default=True, metavar="FOLDER",
    type=click.Path(path_type=Path, file_okay=False),
    help="Folder of the study; one that is there goes on.",
)  # fmt: skip
@click.option("--mean-users", type=NUMBERS, help="λ, mean users in the square of 2000 m.  [15,16,20]")
@click.option("--clusters", type=WHOLE_NUMBERS, help="K.  [4]")
@click.option("--threshold-db", "snr_threshold_db", type=NUMBERS, help="γ_th, SNR threshold.  [3]")
@click.option("--altitude-m", type=NUMBERS, help="H.  [100]")
@click.option("--planners", type=NAMES, help="Their names.  [tloaik,stoaik,boaik,sbw]")
@click.option("--seeds", type=Seeds(), help="How many draws of each (300), or which (0-1999).  [300]")
@click.option(
    "--generator", type=click.Choice(["pairs", "users"]), help="Draw pairs or single users.  [pairs]"
)
@click.option(
    "--hold", "held", type=click.Choice(["radius", "power"]),
    help="While γ_th and H vary, hold the coverage radius and adapt the power, or the other way round.  [radius]",
)  # fmt: skip
@worker_options
@click.option("--parquet", is_flag=True, help="Write study.parquet beside study.csv.")
@click.option(
    "--pictures", type=click.Choice(["png", "svg", "pdf"]), help="Draw the figures over λ and sweeps."
)
def study_command(
    folder: Path,
    jobs: int | None,
    cluster: str | None,
    parquet: bool,
    pictures: str | None,
    **given: Any,
) -> None:
    """Run the planners on many random draws of users and compare them with SBW, the benchmark.

    Without options: the paper's regime. In a folder with a study, what is not said stays as it is there; an
    interrupted study goes on, and more seeds, planners or values extend it.

    \b
    mavplan study -o out/regime --seeds 2000 --pictures png
    mavplan study -o out/threshold --mean-users 16 --threshold-db 0,3,6,10,15,20 --seeds 500
    mavplan study -o out/threshold --seeds 2000 --cluster tcp://192.168.1.5:8786
    """
    from mavplan.cli.console import answer, progress, say_problems, tell_written
    from mavplan.study.engine import run_study
    from mavplan.study.outputs import check_parquet, write_outputs
    from mavplan.study.store import read_settings
    from mavplan.study.summary import flat, summarise

    if parquet:
        check_parquet()
    if pictures is not None:
        from mavplan.figures.study import check_matplotlib

        check_matplotlib()
    settings = settings_of(read_settings(folder), given)
    try:
        with progress("studying") as tell:
            rows, warnings = run_study(folder, settings, jobs=jobs, cluster=cluster, progress=tell)
    except KeyboardInterrupt:
        click.echo(
            f"what was finished is kept in {folder}: 'mavplan study -o {folder}' goes on there", err=True
        )
        raise
    say_problems(warnings)
    lines = summarise(rows)
    written = write_outputs(folder, settings, rows, lines, parquet=parquet, pictures=pictures)
    if lines:
        print_summary(lines)
    tell_written(written)
    found = {
        "folder": str(folder),
        "settings": settings.to_json(),
        "rows": len(rows),
        "summary": [flat(line) for line in lines],
        "written": [str(path) for path in written],
    }
    answer(found)


def settings_of(there: "Settings | None", given: dict[str, Any]) -> "Settings":
    """Return the settings of the folder, else the regime's, with what the command line says instead."""
    import dataclasses

    from mavplan.study.settings import Settings

    said = {key: value for key, value in given.items() if value is not None}
    return Settings(**said) if there is None else dataclasses.replace(there, **said)


def print_summary(lines: "list[Line]") -> None:
    """Print a row for each setting and planner; ± is half of a 95 % interval."""
    from mavplan.cli.console import plain_table, print_table
    from mavplan.study.settings import as_text

    table = plain_table(f"SBW = 1; ± is a 95 % interval over {lines[0].cases:,} draws")
    for heading in ("λ", "H m", "γ_th dB", "K"):
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("planner", no_wrap=True)
    for heading in ("stops", "length", "sum rate", "ρ_e", "difference of ρ_e"):
        table.add_column(heading, justify="right", no_wrap=True)
    before = None
    for line in lines:
        first = line.group != before
        before = line.group
        table.add_row(
            *(as_text(value) if first else "" for value in line.group),
            line.planner.upper(),
            f"{line.stops:.1f}",
            _plus_minus(line.length),
            _plus_minus(line.sum_rate),
            _plus_minus(line.rho_e),
            f"{_plus_minus(line.rho_e_difference, '+')} to {line.less.upper()}" if line.less else "",
        )
    print_table(table)


def _plus_minus(found: "Interval | None", sign: str = "") -> str:
    """Return an estimate with half of its interval."""
    if found is None:
        return "–"
    half = found.half_width
    return f"{found.value:{sign}.3f}" + ("" if half is None else f" ±{half:.3f}")
