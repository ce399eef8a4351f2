"""The C header writes what the services read, and reads what they write."""

from __future__ import annotations

import shutil
import struct
import subprocess
from dataclasses import replace
from pathlib import Path

import msgpack
import numpy as np
import pytest

from onemap_shared import keys
from onemap_shared.camera import Intrinsics
from onemap_shared.messages import Odometry, RgbdFrame, VelocityCommand
from onemap_shared.wire import Packet, decode, encode
from tests.structure import ROOT

FOLDER = ROOT / "examples" / "c"
STAMP = 1_700_000_000_000_000_000
ODOMETRY = Odometry(
    41,
    STAMP,
    np.array([[1.0, 0, 0, 1.5], [0, 1, 0, -2], [0, 0, 1, 0], [0, 0, 0, 1]]),
    0.5,
    -0.25,
    planner="5f3a9c01d2e4",
    command_sequence=300,
    driver="0b6d1f52a7c3",
)
FRAME = RgbdFrame(
    7,
    STAMP,
    np.arange(105, dtype=np.uint8).reshape(5, 7, 3),
    (1000 + np.arange(35, dtype=np.uint16)).reshape(5, 7),
    Intrinsics(195.0, 195.0, 3.0, 2.0),
    np.array([[0.0, 0, 1, 1.6], [-1, 0, 0, -2], [0, -1, 0, 1], [0, 0, 0, 1]]),
)
COMMAND = VelocityCommand(
    9,
    STAMP,
    -0.125,
    0.3,
    validity_ms=250,
    planner="5f3a9c01d2e4",
    odometry_stamp_ns=STAMP - 7,
    driver="0b6d1f52a7c3",
)


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("needs a C compiler: apt-get install gcc")
    path = tmp_path_factory.mktemp("c") / "wire_example"
    strict = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-O1")
    subprocess.run([compiler, *strict, "-o", path, FOLDER / "wire_example.c"], check=True)
    return path


def run(program: Path, header: bytes) -> subprocess.CompletedProcess[bytes]:
    """The program's run on the header of a command."""
    told = struct.pack("<I", len(header)) + header
    return subprocess.run([program], input=told, capture_output=True, timeout=90, check=False)


def packets(output: bytes) -> tuple[Packet, Packet, list[str]]:
    """The two packets that it writes, and the words that it prints then."""
    found = []
    for _ in range(2):
        header, body = struct.unpack_from("<II", output)
        end = 8 + header + body
        found.append(Packet(output[8 : 8 + header], output[8 + header : end]))
        output = output[end:]
    return found[0], found[1], output.decode().removesuffix("\n").split(" ")


def test_the_services_read_them(program: Path) -> None:
    odometry, frame, _ = packets(run(program, encode(COMMAND).header).stdout)
    received = decode(Odometry, odometry)
    assert encode(received) == encode(ODOMETRY)
    assert encode(decode(RgbdFrame, frame)) == encode(FRAME)


@pytest.mark.parametrize(
    "command",
    [
        COMMAND,
        replace(COMMAND, sequence=70_000, linear_mps=0.0, planner=""),
        replace(COMMAND, planner="x" * 64, validity_ms=0),
    ],
)
def test_a_velocity_command_is_read(program: Path, command: VelocityCommand) -> None:
    done = run(program, encode(command).header)
    assert done.returncode == 0
    _, _, words = packets(done.stdout)
    values = (command.sequence, command.stamp_ns, command.linear_mps, command.angular_radps)
    rest = (command.validity_ms, command.planner, command.driver, command.odometry_stamp_ns)
    assert [float(w) for w in words[:4]] == [float(v) for v in values]
    assert words[4:] == [str(v) for v in rest]


def test_numbers_may_be_sent_as_integers(program: Path) -> None:
    header = msgpack.unpackb(encode(COMMAND).header)
    header["values"] |= {"linear_mps": 1, "new_in_a_later_release": 5}
    done = run(program, msgpack.packb(header))
    assert done.returncode == 0
    assert packets(done.stdout)[2][2] == "1"


WHOLE = encode(COMMAND).header
OTHERS = {
    "another message": encode(ODOMETRY).header,
    "valid for too long": WHOLE.replace(b"\xcc\xfa", b"\xcd\x01\x2d"),
    "empty": b"",
    "garbage": b"\xc1" * 40,
    "no velocity": msgpack.packb({"schema": "onemap.VelocityCommand/1", "values": {}}),
    "not finite": WHOLE.replace(
        struct.pack(">d", COMMAND.linear_mps), struct.pack(">d", float("nan"))
    ),
    **{f"cut off at {size}": WHOLE[:size] for size in range(1, len(WHOLE) - 8, 7)},
}


@pytest.mark.parametrize("case", OTHERS)
def test_what_is_no_command_is_refused(program: Path, case: str) -> None:
    done = run(program, OTHERS[case])
    assert done.returncode == 3, done.stderr
    assert done.stderr == b"not a velocity command\n"


def test_the_keys_are_those_of_the_bus() -> None:
    header = (FOLDER / "onemap_wire.h").read_text(encoding="utf-8")
    for topic in (keys.ROBOT_RGBD, keys.ROBOT_ODOMETRY, keys.ROBOT_CMD_VEL):
        assert f'"{topic.key}"' in header
