"""A serial port as a connection, through pyserial, which only users of one need."""

import contextlib
import os
import time
from typing import Any

from mavplan.errors import InputError, NoLinkError
from mavplan.link.connection import RECONNECT_S, WRITE_S, Connection
from mavplan.link.endpoint import Endpoint


class Serial(Connection):
    """A serial port; when it is unplugged, it is opened again as soon as it is back."""

    def __init__(self, endpoint: Endpoint) -> None:
        try:
            import serial
        except ImportError as error:
            raise InputError(
                f"{endpoint} is a serial port, for which the package pyserial is missing: pip install 'mavplan[serial]'"
            ) from error
        self._endpoint = endpoint
        self._module = serial
        self._port: Any = None
        self._again_at = 0.0
        try:
            self._open()
        except (serial.SerialException, ValueError) as error:
            # pyserial's own message has the number and the name of the port twice.
            number = getattr(error, "errno", None)
            why = os.strerror(number) if isinstance(number, int) else str(error)
            raise NoLinkError(f"cannot open {endpoint}: {why}") from error

    def _open(self) -> None:
        self._port = self._module.Serial(
            self._endpoint.device, self._endpoint.baud, timeout=0, write_timeout=WRITE_S
        )

    def read(self, timeout_s: float) -> bytes:
        """Return what has come; see `Connection`."""
        until = time.monotonic() + timeout_s
        try:
            if self._port is None and not self._reopen(timeout_s):
                return b""
            self._port.timeout = max(0.0, until - time.monotonic())
            first: bytes = self._port.read(1)
            rest: bytes = self._port.read(self._port.in_waiting) if first else b""
            return first + rest
        except (self._module.SerialException, OSError):
            self._drop()
            return b""

    def write(self, data: bytes) -> None:
        """Send a frame; see `Connection`."""
        if self._port is None:
            return
        try:
            self._port.write(data)
        except self._module.SerialTimeoutException:
            return
        except (self._module.SerialException, OSError):
            self._drop()

    def _reopen(self, timeout_s: float) -> bool:
        wait_s = self._again_at - time.monotonic()
        if wait_s > 0:
            time.sleep(min(wait_s, max(0.0, timeout_s)))
            if wait_s > timeout_s:
                return False
        self._again_at = time.monotonic() + RECONNECT_S
        with contextlib.suppress(self._module.SerialException, OSError):
            self._open()
        return self._port is not None

    def _drop(self) -> None:
        if self._port is not None:
            with contextlib.suppress(self._module.SerialException, OSError):
                self._port.close()
        self._port = None
        self._again_at = time.monotonic() + RECONNECT_S

    def close(self) -> None:
        """Close it."""
        self._drop()
