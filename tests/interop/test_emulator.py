"""pymodbus as the client of the imitated D-500: the wire rules of its manual, judged from outside."""

import socket
import time

import pytest
from pymodbus.exceptions import ModbusIOException

from conftest import busbar, client, emulation

MAX_READ = 16
PUSH_BUTTONS = 8193
SELECT_CHANNEL = 8194
RESET = 8210
SELECTED_CHANNEL = 10403
UNIT_MODE = 10605
IDENTITY = 10609


@pytest.fixture(scope="module")
def profile():
    return busbar("profile", "show", "datakom-d", "--json").json()


def windows(profile):
    """Every readable range, cut into reads of 16 registers at most."""
    for start, end in profile["wire"]["readable"]:
        for address in range(start, end + 1, MAX_READ):
            yield address, min(MAX_READ, end + 1 - address)


def read(modbus, address, count=1, **kwargs):
    answer = modbus.read_holding_registers(address, count=count, **kwargs)
    assert not answer.isError(), f"{address}+{count}: {answer}"
    return answer.registers


def refusal(answer):
    """The exception code of an answer."""
    assert answer.isError(), answer
    return answer.exception_code


def test_reads_the_whole_map(modbus, profile):
    total = 0
    for address, count in windows(profile):
        registers = read(modbus, address, count)
        assert len(registers) == count, address
        total += count
    # Every row that the manual prints, LCD (512) and alarm arrays (3 x 16) included.
    assert total == sum(end - start + 1 for start, end in profile["wire"]["readable"])
    assert total > 900


def test_our_client_reads_what_pymodbus_reads(d500, modbus):
    """What stands still is the same to both; the 159 points and more are all there."""
    outcome = busbar("read", "datakom-d", "--from", "tcp://{}:{}".format(*d500), "--json")
    assert outcome.status == 0, outcome.err
    readings = {reading["id"]: reading for reading in outcome.json()}
    assert all(reading["quality"] in ("good", "invalid") for reading in readings.values())
    assert [reading["address"] for reading in readings.values()] == sorted(r["address"] for r in readings.values())
    for point in ("device_identity", "hardware_version", "software_version", "unit_mode"):
        reading = next(r for name, r in readings.items() if name == point or name.endswith(point))
        assert read(modbus, reading["address"], len(reading["raw"])) == reading["raw"]


def test_long_reads_are_cut_to_16(modbus):
    for count in (17, 20, 64, 100, 125):
        assert len(read(modbus, 10240, count)) == MAX_READ, count
    # Cut first, judged then: the range ends at 10551, and the first 16 registers are inside.
    assert len(read(modbus, 10536, 40)) == MAX_READ


def test_unknown_functions_are_exception_1(modbus):
    assert refusal(modbus.read_coils(0)) == 1
    assert refusal(modbus.read_discrete_inputs(0)) == 1
    assert refusal(modbus.read_input_registers(10240)) == 1
    assert refusal(modbus.write_coil(0, True)) == 1
    assert refusal(modbus.write_coils(0, [True, False])) == 1


def test_addresses_outside_the_map_are_exception_2(modbus, profile):
    for start, end in profile["wire"]["readable"]:
        assert refusal(modbus.read_holding_registers(end + 1)) == 2, end + 1
        assert refusal(modbus.read_holding_registers(end, count=2)) == 2, end
        assert refusal(modbus.read_holding_registers(start - 1, count=2)) == 2, start - 1
    for address in (0, 8193, 8194, 8210, 9999, 65535):
        assert refusal(modbus.read_holding_registers(address)) == 2, address
    assert refusal(modbus.write_register(0, 1)) == 2


def test_protected_registers_are_exception_10(modbus):
    before = read(modbus, UNIT_MODE)
    assert refusal(modbus.write_register(UNIT_MODE, 1)) == 10
    assert refusal(modbus.write_registers(UNIT_MODE, [1])) == 10
    assert refusal(modbus.write_registers(10240, [1, 2, 3])) == 10
    assert read(modbus, UNIT_MODE) == before


def test_other_units_are_silence(d500):
    for unit in (0, 2, 240, 247, 255):
        with client(d500, timeout=0.2) as modbus, pytest.raises(ModbusIOException):
            modbus.read_holding_registers(10240, device_id=unit)
    # Not one byte, and the connection is still good for the right unit.
    with socket.create_connection(d500) as wire:
        wire.settimeout(0.2)
        wire.sendall(bytes.fromhex("0001 0000 0006 02 03 2800 0001"))
        with pytest.raises(TimeoutError):
            wire.recv(1)
        wire.settimeout(10)
        wire.sendall(bytes.fromhex("0002 0000 0006 01 03 2800 0001"))
        assert wire.recv(260)[:9] == bytes.fromhex("0002 0000 0005 01 03 02")


def test_another_unit_id_can_be_imitated():
    with emulation("--unit", "17") as address:
        with client(address) as modbus:
            assert len(read(modbus, 10240, 16, device_id=17)) == 16
        with client(address, timeout=0.2) as modbus, pytest.raises(ModbusIOException):
            modbus.read_holding_registers(10240)


@pytest.mark.parametrize("model, identity", [("D-300", 0xD300), ("D-500", 0xD500), ("D-700", 0xD700)])
def test_models_are_told_apart(model, identity):
    with emulation("--model", model) as address, client(address) as modbus:
        assert read(modbus, IDENTITY) == [identity]


def test_channel_select_changes_the_waveform():
    with emulation() as address, client(address) as modbus:
        for channel in (0, 3, 17, 19):
            answer = modbus.write_register(SELECT_CHANNEL, channel)
            assert not answer.isError() and (answer.address, answer.registers) == (SELECT_CHANNEL, [channel])
            assert read(modbus, SELECTED_CHANNEL) == [channel]


def test_function_16_writes_what_may_be_written():
    with emulation() as address, client(address) as modbus:
        answer = modbus.write_registers(SELECT_CHANNEL, [5])
        assert not answer.isError() and (answer.address, answer.count) == (SELECT_CHANNEL, 1)
        assert read(modbus, SELECTED_CHANNEL) == [5]


def test_push_buttons_change_the_mode():
    with emulation("--model", "D-500") as address, client(address) as modbus:
        for key, mode in ((1, 1), (4, 4), (8, 8), (1, 1)):
            answer = modbus.write_register(PUSH_BUTTONS, key)
            assert not answer.isError() and (answer.address, answer.registers) == (PUSH_BUTTONS, [key])
            deadline = time.monotonic() + 10
            while read(modbus, UNIT_MODE) != [mode]:
                assert time.monotonic() < deadline, f"key {key} did not lead to mode {mode}"


def test_values_move(modbus):
    """The plant runs: within some seconds a measured value is another one."""
    before = read(modbus, 10240, 16)
    deadline = time.monotonic() + 30
    while read(modbus, 10240, 16) == before:
        assert time.monotonic() < deadline, "nothing moved"


def test_32_bit_values_come_low_word_first(d500, modbus):
    """The genset or mains voltage is a voltage in one order only."""
    low, high = read(modbus, 10240, 2)
    volts = (high << 16 | low) / 10
    swapped = (low << 16 | high) / 10
    assert 0 <= volts < 1000 and (volts == 0 or swapped > 1000)


def test_several_clients_at_once(d500):
    with client(d500) as one, client(d500) as two, client(d500) as three:
        for _ in range(20):
            assert {len(read(peer, 10240, 16)) for peer in (one, two, three)} == {16}


def test_requests_in_one_packet_are_answered_in_order(d500):
    with socket.create_connection(d500) as wire:
        wire.settimeout(10)
        wire.sendall(b"".join(bytes.fromhex(f"{n:04x} 0000 0006 01 03 2800 0001") for n in range(1, 9)))
        answers = b""
        while len(answers) < 8 * 11:
            chunk = wire.recv(1000)
            assert chunk, "the connection was closed"
            answers += chunk
        assert [answers[at * 11 + 1] for at in range(8)] == list(range(1, 9))


def test_a_pinned_point_stays():
    with emulation("--set", "fuel_level=12.5") as address:
        reading = busbar("read", "datakom-d", "--from", "tcp://{}:{}".format(*address), "fuel_level", "--json").json()
        assert [r["value"] for r in reading] == [12.5]
        with client(address) as modbus:
            assert read(modbus, 10363) == [125]
