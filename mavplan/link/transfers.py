"""Who carries out uploads and downloads: `OWN`, or what `mavplan.link.mavsdk` puts in its place."""

from collections.abc import Callable
from dataclasses import dataclass

from mavplan.link.download import Download
from mavplan.link.upload import Upload


@dataclass(frozen=True, slots=True)
class Transfers:
    """Makes the transfers of a session.

    Attributes
    ----------
    upload, download
        Called with the parameters of `Upload` and `Download`.
    """

    upload: Callable[..., Upload] = Upload
    download: Callable[..., Download] = Download


OWN = Transfers()
"""Our own state machines."""
