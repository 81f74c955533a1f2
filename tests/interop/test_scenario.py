"""A scenario while pymodbus, libmodbus and mbpoll watch it: what they read is the story that the binary tells."""

import re
import subprocess

import pytest

from conftest import BINARY, PATIENCE, ROOT, busbar
from strangers import STRANGERS, Wire

SCENARIO = ROOT / "examples" / "scenarios" / "mains-failure.toml"
# The manual's operation status, and mode, of a D-series unit.
STATUS, MODE = 10604, 10605
# Three minutes in some seconds: what lasts for seconds comes and goes unseen, as it would with a slow client.
SPEED = 40
TOLD = re.compile(r"^ *([\d.]+) s +state\.engine (?:\w+ )?\((.*)\)$", re.MULTILINE)


def labels():
    """What the codes of the status mean, by the profile."""
    points = busbar("profile", "show", "datakom-d", "--json").json()["points"]
    choices = next(point["choices"] for point in points if point["id"] == "operation_status")
    return {choice["value"]: choice["label"] for choice in choices}


def watch(stranger, wire, process):
    """The statuses that a stranger sees one after the other until the scenario is over."""
    seen = []
    with stranger(wire, 1, timeout=2) as client:
        while process.poll() is None:
            try:
                status, mode = client.read(STATUS, 2)
            except Exception:
                # Whoever asks at the very end finds nobody; anything earlier is a fault.
                process.wait(timeout=2)
                break
            assert mode == 4, "it stays in AUTO"
            if seen[-1:] != [status]:
                seen.append(status)
    return seen


def is_within(part, whole):
    """Whether all of a list comes in another one, in its order."""
    rest = iter(whole)
    return all(item in rest for item in part)


@pytest.mark.parametrize("stranger", STRANGERS)
def test_a_stranger_reads_the_story_that_is_told(stranger, tmp_path):
    call = [BINARY, "emulate", "datakom-d", "--listen", "tcp://127.0.0.1:0", "--speed", str(SPEED), "--scenario", SCENARIO]
    with (tmp_path / "told").open("w+") as err:
        with subprocess.Popen(call, stdout=subprocess.PIPE, stderr=err, text=True) as process:
            try:
                seen = watch(stranger, Wire.of(process.stdout.readline().strip()), process)
                process.wait(timeout=PATIENCE)
            finally:
                process.kill()
        err.seek(0)
        story = err.read()
    assert process.returncode == 0, story
    told = [label for _, label in TOLD.findall(story)]
    names = labels()
    read = [names[code] for code in seen]
    assert read[0] == "Genset at rest"
    assert is_within(read[1:], told), f"read {read}, told {told}"
    for long in ("Master genset on load", "Cooling down"):
        assert long in read, f"{long} is not in {read}"
