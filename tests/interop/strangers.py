"""Three strangers as clients: pymodbus, libmodbus and mbpoll, over TCP and over a serial device, with one manner of asking.

Each asks a question once. A refusal is `Refused` with the exception code, no answer is `Silent`.
"""

import ctypes
import re
import subprocess
from dataclasses import dataclass

from pymodbus.client import ModbusSerialClient, ModbusTcpClient
from pymodbus.exceptions import ModbusIOException

# Far above what anything here takes.
PATIENCE = 60
# How long a stranger waits where nobody is to answer, and everywhere else.
SHORT = 0.5
LONG = 10


class Refused(Exception):
    """The device answered with an exception."""

    def __init__(self, code):
        super().__init__(f"exception {code}")
        self.code = code


class Silent(Exception):
    """Nobody answered."""


@dataclass(frozen=True)
class Wire:
    """Where the imitation answers: host and port, or a serial device at 9600 8N1."""

    host: str | None = None
    port: int | None = None
    device: str | None = None

    @classmethod
    def of(cls, url):
        """From the URL that the binary printed."""
        if url.startswith("tcp://"):
            host, _, port = url.removeprefix("tcp://").rpartition(":")
            return cls(host=host, port=int(port))
        device, _, settings = url.removeprefix("rtu://").partition("?")
        assert settings == "baud=9600&parity=none&stop=1", url
        return cls(device=device)


class Pymodbus:
    """pymodbus, in Python."""

    def __init__(self, wire, unit, timeout=LONG):
        self.unit = unit
        if wire.device:
            self.peer = ModbusSerialClient(wire.device, baudrate=9600, parity="N", stopbits=1, timeout=timeout, retries=0)
        else:
            self.peer = ModbusTcpClient(wire.host, port=wire.port, timeout=timeout, retries=0)
        assert self.peer.connect()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.peer.close()

    def read(self, address, count=1):
        return self._ask(self.peer.read_holding_registers, address, count=count).registers

    def write(self, address, value):
        answer = self._ask(self.peer.write_register, address, value)
        assert (answer.address, answer.registers) == (address, [value])

    def write_several(self, address, values):
        self._ask(self.peer.write_registers, address, values)

    def press(self, coil, on=True):
        answer = self._ask(self.peer.write_coil, coil, on)
        assert (answer.address, answer.bits[0]) == (coil, on)

    def _ask(self, call, *arguments, **more):
        try:
            answer = call(*arguments, device_id=self.unit, **more)
        except ModbusIOException as error:
            raise Silent from error
        if answer.isError():
            raise Refused(answer.exception_code)
        return answer


class Libmodbus:
    """libmodbus, in C."""

    # Where its own error numbers begin; the exceptions of the standard come first, in their order.
    ERRORS = 112345678

    library = None

    def __init__(self, wire, unit, timeout=LONG):
        self.lib = self._load()
        if wire.device:
            self.context = self.lib.modbus_new_rtu(wire.device.encode(), 9600, ord("N"), 8, 1)
        else:
            self.context = self.lib.modbus_new_tcp(wire.host.encode(), wire.port)
        assert self.context
        seconds, rest = divmod(timeout, 1)
        assert self.lib.modbus_set_response_timeout(self.context, int(seconds), int(rest * 1e6)) == 0
        assert self.lib.modbus_set_slave(self.context, unit) == 0
        assert self.lib.modbus_connect(self.context) == 0

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.lib.modbus_close(self.context)
        self.lib.modbus_free(self.context)

    def read(self, address, count=1):
        registers = (ctypes.c_uint16 * 125)()
        got = self._check(self.lib.modbus_read_registers(self.context, address, count, registers))
        return registers[:got]

    def write(self, address, value):
        self._check(self.lib.modbus_write_register(self.context, address, value))

    def write_several(self, address, values):
        words = (ctypes.c_uint16 * len(values))(*values)
        self._check(self.lib.modbus_write_registers(self.context, address, len(values), words))

    def press(self, coil, on=True):
        self._check(self.lib.modbus_write_bit(self.context, coil, int(on)))

    def _check(self, result):
        if result >= 0:
            return result
        number = ctypes.get_errno()
        if 0 < number - self.ERRORS <= 16:
            raise Refused(number - self.ERRORS)
        raise Silent(self.lib.modbus_strerror(number).decode())

    @classmethod
    def _load(cls):
        if cls.library is None:
            lib = ctypes.CDLL("libmodbus.so.5", use_errno=True)
            lib.modbus_strerror.restype = ctypes.c_char_p
            for name in ("modbus_new_tcp", "modbus_new_rtu"):
                getattr(lib, name).restype = ctypes.c_void_p
            for name in (
                "set_response_timeout", "set_slave", "connect", "close", "free",
                "read_registers", "write_register", "write_registers", "write_bit",
            ):
                call = getattr(lib, f"modbus_{name}")
                call.argtypes = [ctypes.c_void_p]  # What follows is int or pointer, as it is given.
            cls.library = lib
        return cls.library


class Mbpoll:
    """mbpoll, a program: a process for each question."""

    def __init__(self, wire, unit, timeout=LONG):
        self.wire, self.unit, self.timeout = wire, unit, min(timeout, 10)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def read(self, address, count=1):
        out = self._call("-t", "4:hex", "-r", address, "-c", count, "-1")
        return [int(word, 16) for word in re.findall(r"^\[\d+\]:\s+0x([0-9A-F]{4})", out, re.MULTILINE)]

    def write(self, address, value):
        self._call("-t", "4", "-r", address, values=[value])

    def write_several(self, address, values):
        assert len(values) > 1, "a single one goes by function 6"
        self._call("-t", "4", "-r", address, values=values)

    def press(self, coil, on=True):
        self._call("-t", "0", "-r", coil, values=[int(on)])

    def _call(self, *options, values=()):
        if self.wire.device:
            where = ["-m", "rtu", "-b", 9600, "-P", "none", "-s", 1, self.wire.device]
        else:
            where = ["-m", "tcp", "-p", self.wire.port, self.wire.host]
        call = ["mbpoll", "-0", "-a", self.unit, "-o", f"{self.timeout:.2f}", *options, *where, *values]
        done = subprocess.run(list(map(str, call)), capture_output=True, text=True, timeout=PATIENCE, check=False)
        return self._judge(done.stdout, done.stderr)

    EXCEPTIONS = {"Illegal function": 1, "Illegal data address": 2, "Illegal data value": 3, "Gateway path unavailable": 10}

    def _judge(self, out, err):
        for words, code in self.EXCEPTIONS.items():
            if words in err:
                raise Refused(code)
        if "timed out" in err:
            raise Silent(err)
        assert "failed" not in err and "rror" not in err, err
        return out


STRANGERS = [Pymodbus, Libmodbus, Mbpoll]
