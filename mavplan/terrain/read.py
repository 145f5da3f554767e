"""Reading ground from GeoTIFF and SRTM files: one window round the scenario, everything else about them refused.

Files on this machine only, two formats only, nothing beside them is looked at. GDAL is imported where there is a file.
"""

import re
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mavplan.geo import LocalPlane
from mavplan.scenario.files import file_fault
from mavplan.scenario.report import Report, figure, shown
from mavplan.scenario.sections import TerrainOptions
from mavplan.terrain.grid import Floats, Terrain

MOST_FILES = 64
MOST_CELLS = 25_000_000
"""Of the window: 100 MB."""
MOST_BLOCK_CELLS = 30_000_000
"""Of a block of the file, which is unpacked as a whole."""
LEAST_M, MOST_M = -500.0, 9000.0
"""Nothing on Earth is lower or higher: such a cell is one without a height."""
ALIGNED = 0.02
"""Part of a cell by which tiles may be off one grid."""

_ELLIPSOID = re.compile(r"ellips|wgs|grs|etrs|itrf|nad ?83|^hae$", re.IGNORECASE)
_HGT_NAME = re.compile(r"[NS][0-9]{2}[EW][0-9]{3}", re.IGNORECASE)
_TIFF = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")
_ENVIRONMENT = {
    "GDAL_DISABLE_READDIR_ON_OPEN": "EMPTY_DIR",
    "GDAL_PAM_ENABLED": "NO",
    "GDAL_GEOREF_SOURCES": "INTERNAL",
    "GTIFF_REPORT_COMPD_CS": "YES",
    "GDAL_CACHEMAX": 64,
}


class _UnusableError(Exception):
    """A file that cannot be used, with the sentence and the code for the reader."""

    def __init__(self, message: str, code: str) -> None:
        super().__init__(message)
        self.message, self.code = message, code


@dataclass(frozen=True)
class _Cells:
    """From places in the plane to columns and rows of a window, whole numbers at the middles of cells."""

    plane: LocalPlane
    to_raster: Any
    inverse: Any
    first_column: int
    first_row: int

    def __call__(self, places_m: Floats) -> Floats:
        lat_deg, lon_deg = self.plane.to_lat_lon_deg(places_m)
        x, y = self.to_raster.transform(lon_deg, lat_deg)
        column, row = _at(self.inverse, np.asarray(x), np.asarray(y))
        return np.column_stack([column - 0.5 - self.first_column, row - 0.5 - self.first_row])


def read_terrain(
    options: TerrainOptions,
    folder: Path,
    plane: LocalPlane,
    box_m: tuple[float, float, float, float],
    where: str,
    report: Report,
) -> Terrain | None:
    """Return the ground in a box; None with a problem noted.

    Parameters
    ----------
    options
        With at least one file.
    folder
        Files stand relative to it.
    plane
        Of the scenario.
    box_m
        West, south, east and north end, metres from home. What of it the files do not have is not known.
    where
        Place of the section, for messages.
    report
        Takes the problems.
    """
    names = [options.file] if isinstance(options.file, str) else list(options.file or ())
    if not 1 <= len(names) <= MOST_FILES:
        report.error(f"{where} file", f"names {len(names)} files; 1 to {MOST_FILES} are read", "count")
        return None
    if options.datum is not None and (not options.datum.strip() or _ELLIPSOID.search(options.datum.strip())):
        report.error(f"{where} datum", f"found {shown(options.datum)}; {_NOT_ELLIPSOID}", "datum")
        return None
    before = report.count
    paths = [_path(name, folder, f"{where} file", report) for name in names]
    if report.count > before:
        return None
    return _mosaic([path for path in paths if path is not None], options.datum, plane, box_m, where, report)


_NOT_ELLIPSOID = (
    "heights above an ellipsoid are tens of metres off mean sea level and are not taken: "
    'give a terrain above a geoid and name that, as datum = "EGM96"'
)


def _path(name: str, folder: Path, where: str, report: Report) -> Path | None:
    if "://" in name or name.startswith("/vsi") or "\0" in name or not name.strip():
        message = f"found {shown(name)}; it names a file on this machine: nothing is fetched"
        report.error(where, message, "not-a-file")
        return None
    path = folder / name
    try:
        fault, code = file_fault(path), "unreadable"
    except FileNotFoundError:
        fault, code = "there is no such file", "missing-file"
    except OSError as error:
        fault, code = f"cannot be read: {error.strerror or error}", "unreadable"
    if fault is not None:
        report.error(str(path), fault, code)
        return None
    return path


def _mosaic(
    paths: Sequence[Path],
    datum: str | None,
    plane: LocalPlane,
    box_m: tuple[float, float, float, float],
    where: str,
    report: Report,
) -> Terrain | None:
    """Return the window that the box asks for, filled from all files, which stand on one grid."""
    import rasterio

    base: _Tile | None = None
    heights: NDArray[np.float32] | None = None
    cells: _Cells | None = None
    with rasterio.Env(**_ENVIRONMENT), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # what they say is looked at here, and said as a problem
        for path in paths:
            try:
                tile = _tile(path, datum)
                with tile.source as source:
                    if base is None or heights is None or cells is None:
                        base, cells = tile, _window(tile, plane, box_m)
                        columns, rows = _size(cells, box_m)
                        heights = np.full((rows, columns), np.nan, dtype=np.float32)
                    _fill(heights, cells, source, base, tile)
            except _UnusableError as refused:
                report.error(str(path), refused.message, refused.code)
                return None
            except (rasterio.errors.RasterioError, OSError, ValueError) as error:
                words = "".join(c if c.isprintable() else " " for c in str(error.__cause__ or error))[:200]
                message = f"cannot be read as terrain, it is damaged or cut off: {words}"
                report.error(str(path), message, "unreadable")
                return None
    assert base is not None
    assert heights is not None
    assert cells is not None
    if np.isnan(heights).all():
        report.error(f"{where} file", "has no height anywhere near home and the users", "not-covered")
        return None
    label = paths[0].name if len(paths) == 1 else f"{paths[0].name} and {len(paths) - 1} more"
    return Terrain(heights, cells, _pitch_m(cells), label, base.datum)


@dataclass(frozen=True)
class _Tile:
    """An open file and what its keys say."""

    source: Any
    crs: Any
    datum: str


def _tile(path: Path, datum: str | None) -> _Tile:
    """Open a file and hold it to what can be used."""
    import rasterio

    with path.open("rb") as stream:
        head = stream.read(4)
    if head in _TIFF:
        driver = "GTiff"
    elif path.suffix.lower() == ".hgt":
        driver = "SRTMHGT"
        if not _HGT_NAME.fullmatch(path.name.partition(".")[0]):
            raise _UnusableError(
                "says in its name which square it is, as N46E007.hgt; nothing else in it does", "hgt-name"
            )
        if path.stat().st_size not in (2 * 1201**2, 2 * 3601**2):
            raise _UnusableError(
                "has neither 1201² nor 3601² heights of two bytes: it is cut off, or no SRTM", "hgt-size"
            )
    else:
        raise _UnusableError("is neither GeoTIFF nor an SRTM .hgt; terrain is read from these", "file-type")
    source = rasterio.open(path.resolve(), driver=driver)
    try:
        _check_layout(source)
        crs, own = _horizontal_and_datum(source)
        if driver == "SRTMHGT":
            own = "EGM96"
        return _Tile(source, crs, _datum(own, datum))
    except BaseException:
        source.close()
        raise


def _check_layout(source: Any) -> None:
    if source.count != 1:
        raise _UnusableError(f"has {source.count} bands; a terrain has one, its height", "bands")
    if np.dtype(source.dtypes[0]).kind not in "iuf":
        raise _UnusableError(f"holds {source.dtypes[0]}, which is no height", "cell-type")
    unit = (source.units[0] or "m").lower()
    if unit not in ("m", "metre", "meter", "metres", "meters"):
        raise _UnusableError(f"has its heights in {shown(unit)}; convert them to metres", "unit")
    if source.crs is None or source.transform.is_degenerate:
        raise _UnusableError("does not say where on Earth it lies: it has no coordinate system", "no-crs")
    rows, columns = source.block_shapes[0]
    if rows * columns > MOST_BLOCK_CELLS:
        raise _UnusableError(
            f"is packed in blocks of {figure(rows * columns)} cells, at most {figure(MOST_BLOCK_CELLS)} are "
            "unpacked: convert it with gdal_translate -co TILED=YES",
            "too-large",
        )


def _horizontal_and_datum(source: Any) -> tuple[Any, str | None]:
    """Return the horizontal coordinate system of a file, and what its heights are above if its keys say."""
    from pyproj import CRS
    from pyproj.exceptions import CRSError

    try:
        crs = CRS.from_wkt(source.crs.to_wkt())
    except CRSError:
        raise _UnusableError("has a coordinate system that is not understood", "crs") from None
    vertical = next((part for part in crs.sub_crs_list if part.is_vertical), None)
    flat = crs.sub_crs_list[0] if crs.sub_crs_list else crs
    if vertical is None and len(flat.axis_info) > 2:
        raise _UnusableError(f"is in {flat.name}, in three dimensions: {_NOT_ELLIPSOID}", "ellipsoid-heights")
    if not (flat.is_geographic or flat.is_projected):
        raise _UnusableError(
            f"is in {flat.name}, from which there is no way to latitude and longitude", "crs"
        )
    if vertical is None:
        return flat, None
    if _ELLIPSOID.search(vertical.name):
        raise _UnusableError(f"has its heights above {vertical.name}: {_NOT_ELLIPSOID}", "ellipsoid-heights")
    if any(abs(axis.unit_conversion_factor - 1.0) > 1e-9 for axis in vertical.axis_info):
        raise _UnusableError(
            f"has its heights in {vertical.axis_info[0].unit_name}; convert them to metres", "unit"
        )
    return flat, str(vertical.name)


def _datum(own: str | None, said: str | None) -> str:
    """Return what the heights are above, by the file, by the scenario where the file does not say."""
    if own is None and said is None:
        raise _UnusableError(
            'does not say what its heights are above; where you know, say so in [terrain], as datum = "EGM2008"',
            "no-datum",
        )
    if own is None:
        return str(said).strip()
    if said is not None and _plain(said) not in _plain(own):
        raise _UnusableError(
            f"has its heights above {own}, and [terrain] datum says {shown(said)}", "other-datum"
        )
    return own


def _plain(name: str) -> str:
    return re.sub(r"[^a-z0-9]", "", name.lower())


def _window(tile: _Tile, plane: LocalPlane, box_m: tuple[float, float, float, float]) -> _Cells:
    """Return the way from the plane to the cells of the window that a box asks for."""
    from pyproj import Transformer
    from pyproj.exceptions import ProjError

    try:
        to_raster = Transformer.from_crs(4326, tile.crs, always_xy=True, allow_ballpark=False)
    except ProjError:
        name = tile.crs.name
        raise _UnusableError(
            f"is in {name}, to which no way from WGS84 is known that is good to metres", "crs"
        ) from None
    whole = _Cells(plane, to_raster, ~tile.source.transform, 0, 0)
    column, row = whole(_corners(box_m)).T
    if not (np.isfinite(column).all() and np.isfinite(row).all()):
        raise _UnusableError("does not reach to where home and the users are", "not-covered")
    return _Cells(
        plane, to_raster, whole.inverse, int(np.floor(column.min())) - 1, int(np.floor(row.min())) - 1
    )


def _corners(box_m: tuple[float, float, float, float]) -> Floats:
    """Return places all round a box and in it: its image in the raster need not be one."""
    west, south, east, north = box_m
    x, y = np.meshgrid(np.linspace(west, east, 17), np.linspace(south, north, 17))
    return np.column_stack([x.ravel(), y.ravel()])


def _size(cells: _Cells, box_m: tuple[float, float, float, float]) -> tuple[int, int]:
    column, row = cells(_corners(box_m)).T
    columns, rows = int(np.ceil(column.max())) + 2, int(np.ceil(row.max())) + 2
    if columns * rows > MOST_CELLS:
        raise _UnusableError(
            f"has {figure(columns * rows)} cells round home and the users, at most {figure(MOST_CELLS)} are read: "
            "take a coarser one",
            "too-large",
        )
    return columns, rows


def _fill(heights: NDArray[np.float32], cells: _Cells, source: Any, base: _Tile, tile: _Tile) -> None:
    """Copy what a file has of the window, where nothing is known yet."""
    from rasterio.windows import Window

    if tile.crs != base.crs or tile.datum != base.datum:
        raise _UnusableError(
            "has another coordinate system or datum than the first file: take tiles of one set", "tiles"
        )
    ours, theirs = cells.inverse, source.transform
    corner = _at(ours, theirs.c, theirs.f)
    far = _at(ours, *_at(theirs, source.width, source.height))
    offset = [round(float(part)) for part in corner]
    size = [float(end - begin) for end, begin in zip(far, corner, strict=True)]
    off = [float(part) - whole for part, whole in zip(corner, offset, strict=True)]
    off += [size[0] - source.width, size[1] - source.height]
    if max(map(abs, off)) > ALIGNED:
        raise _UnusableError(
            "does not stand on the grid of the first file: merge the tiles into one file", "tiles"
        )
    first = np.array(offset) - (cells.first_column, cells.first_row)
    begin = np.maximum(first, 0)
    end = np.minimum(np.add(first, source.shape[::-1]), heights.shape[::-1])
    if (end <= begin).any():
        return
    window = Window(*(begin - first).tolist(), *(end - begin).tolist())
    read = source.read(1, window=window, masked=True).astype(np.float32).filled(np.nan)
    with np.errstate(invalid="ignore", over="ignore"):
        read *= np.float32(source.scales[0])
        read += np.float32(source.offsets[0])
        read[~((read >= LEAST_M) & (read <= MOST_M))] = np.nan
    part = heights[begin[1] : end[1], begin[0] : end[0]]
    part[:] = np.where(np.isnan(part), read, part)


def _pitch_m(cells: _Cells) -> float:
    """Return the least distance of the middles of neighbouring rows or columns, at home."""
    step_m = 10.0
    at = cells(np.array([[0.0, 0.0], [step_m, 0.0], [0.0, step_m]]))
    per_m = (at[1:] - at[:1]) / step_m
    return float(1.0 / np.linalg.norm(per_m, axis=0).max())


def _at(affine: Any, x: Any, y: Any) -> tuple[Any, Any]:
    """Return an affine image; written out, for arrays and numbers alike."""
    return affine.a * x + affine.b * y + affine.c, affine.d * x + affine.e * y + affine.f
