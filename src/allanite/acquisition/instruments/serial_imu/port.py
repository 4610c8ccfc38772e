# SPDX-License-Identifier: BSD-3-Clause
"""The only module that knows pyserial: a serial port as bytes, and its errors as ours.

References
----------
.. [1] pyserial 3.5, https://pyserial.readthedocs.io/
"""

from __future__ import annotations

from typing import Any

from allanite.acquisition.instruments.port_names import refusal_of_port
from allanite.acquisition.instruments.serial_imu.layout import PortSettings
from allanite.errors import InstrumentError
from allanite.plain_files.extras import require

__all__ = ["SerialPort"]


class SerialPort:
    """An open serial port, for nobody else as long as it is.

    Parameters
    ----------
    name : str
        "/dev/ttyUSB0", "COM3", or a URL that `refusal_of_port` lets through.
    settings : PortSettings

    Raises
    ------
    InstrumentError
        pyserial is not installed, there is no such port, another program has it, or the name leads to what is none.
    """

    def __init__(self, name: str, settings: PortSettings) -> None:
        if refusal := refusal_of_port(
            name
        ):  # each time: a device that went away may have left another thing behind
            raise InstrumentError(refusal)
        require("serial", "instruments", "a serial port", error=InstrumentError)
        import serial

        self.name = name
        parity = {"none": serial.PARITY_NONE, "even": serial.PARITY_EVEN, "odd": serial.PARITY_ODD}
        # pyserial lets through what the system says on some paths
        self._failures: tuple[type[Exception], ...] = (serial.SerialException, OSError, TypeError, ValueError)
        try:
            self._port: Any = serial.serial_for_url(
                name,
                do_not_open=True,
                baudrate=settings.baud,
                bytesize=settings.bits,
                parity=parity[settings.parity],
                stopbits=settings.stop,
                rtscts=settings.flow == "rtscts",
                xonxoff=settings.flow == "xonxoff",
                timeout=0,
                write_timeout=2.0,
            )
            self._port.exclusive = True
            self._port.open()
            self._port.reset_input_buffer()
        except self._failures as error:
            raise InstrumentError(
                f"{name} cannot be opened: {error}. Is the device connected, is the port free, and do you "
                "have permission?"
            ) from None

    def read(self, timeout: float) -> bytes:
        """All bytes that are there; if there are none, those that come first within `timeout` seconds.

        Raises
        ------
        InstrumentError
            The port is gone.
        """
        try:
            self._port.timeout = timeout
            first = self._port.read(1)
            return bytes(first + self._port.read(self._port.in_waiting)) if first else b""
        except self._failures as error:
            raise InstrumentError(
                f"{self.name} disappeared: {error}. Check the cable and open it again"
            ) from None

    def write(self, payload: bytes) -> None:
        """Send bytes.

        Raises
        ------
        InstrumentError
            The port is gone, or takes nothing.
        """
        try:
            self._port.write(payload)
        except self._failures as error:
            raise InstrumentError(f"{self.name} accepts no bytes: {error}. Open it again") from None

    def close(self) -> None:
        """Give the port back; a port that is gone gives no error."""
        try:
            self._port.close()
        except self._failures:
            return

    def usb_serial_number(self) -> str:
        """Serial number of the adapter, "" where the system knows none."""
        from serial.tools import list_ports

        try:
            numbers = {port.device: port.serial_number for port in list_ports.comports(include_links=True)}
        except self._failures:
            return ""
        return numbers.get(self.name) or ""
