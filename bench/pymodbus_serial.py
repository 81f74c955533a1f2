"""pymodbus as a client of a serial line: reads 16 registers again and again."""

import sys

from pymodbus.client import ModbusSerialClient

path, count = sys.argv[1:]
client = ModbusSerialClient(path, baudrate=9600, timeout=2, retries=0)
assert client.connect()
for _ in range(int(count)):
    assert not client.read_holding_registers(10240, count=16, device_id=1).isError()
