"""RTDE, the dashboard and the streams as bytes, without sockets."""

import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from ur10_robot import Robot

from hrcneuro.ur10 import dashboard, messages, rtde, streams
from hrcneuro.ur10.controller import POWER_OFF
from hrcneuro.ur10.modes import Notice
from hrcneuro.ur10.urscript.lexer import ScriptError
from hrcneuro.ur10.variables import FORMATS, INPUTS, OUTPUTS


class Client:
    """An RTDE session and what it answered."""

    def __init__(self, robot, taken=None):
        self.sent = []
        self.robot = robot
        self.session = rtde.RtdeSession(robot.controller, {} if taken is None else taken, self.sent.append)

    def ask(self, kind, payload=b""):
        """Return the answer's payload; its header is checked."""
        self.sent.clear()
        self.session.feed(struct.pack(">H", 3 + len(payload)) + kind + payload)
        (answer,) = self.sent
        assert struct.unpack(">H", answer[:2])[0] == len(answer)
        assert answer[2:3] == kind
        return answer[3:]

    def outputs(self, names, rate=125.0):
        return self.ask(b"O", struct.pack(">d", rate) + names)

    def send(self, recipe, form, *values):
        self.sent.clear()
        body = struct.pack(">B" + form, recipe, *values)
        self.session.feed(struct.pack(">H", 3 + len(body)) + b"U" + body)
        return b"".join(self.sent)


@pytest.fixture
def client(robot):
    one = Client(robot)
    assert one.ask(b"V", b"\0\2") == b"\1"
    return one


def test_version_2_streams_what_was_asked_for(client, robot):
    assert client.ask(b"v") == struct.pack(">4I", 3, 9, 1, 64192)
    assert client.outputs(b"timestamp,actual_q,runtime_state") == b"\1DOUBLE,VECTOR6D,UINT32"
    assert client.ask(b"S") == b"\1"
    client.sent.clear()
    robot.controller.cycle()
    client.session.tick()
    (packet,) = client.sent
    assert struct.unpack(">HBB", packet[:4]) == (4 + 8 + 48 + 4, ord("U"), 1)
    values = struct.unpack(">7dI", packet[4:])
    assert values == (0.008, *robot.controller.arm.q, 1)
    assert client.ask(b"P") == b"\1"
    client.sent.clear()
    client.session.tick()
    assert not client.sent


def test_version_1_has_no_recipe_numbers_in_outputs(robot):
    client = Client(robot)
    assert client.ask(b"O", b"timestamp,robot_mode") == b"DOUBLE,INT32"
    client.ask(b"S")
    client.sent.clear()
    client.session.tick()
    assert len(client.sent[0]) == 3 + 12
    client.ask(b"P")
    assert client.ask(b"I", b"input_int_register_1") == b"\1INT32"


@pytest.mark.parametrize("version", [0, 3, 65535])
def test_unknown_versions_are_refused(robot, version):
    assert Client(robot).ask(b"V", struct.pack(">H", version)) == b"\0"


def test_unknown_and_later_fields_are_not_found(client, new_robot):
    assert client.outputs(b"timestamp,nonsense") == b"\0DOUBLE,NOT_FOUND"
    assert client.outputs(b"payload") == b"\0NOT_FOUND"
    later = Client(new_robot(version=(3, 15, 8, 106339)))
    later.ask(b"V", b"\0\2")
    assert later.outputs(b"payload,payload_inertia") == b"\1DOUBLE,VECTOR6D"
    assert client.ask(b"I", b"input_int_register_0,nonsense") == b"\0INT32,NOT_FOUND"


@pytest.mark.parametrize(
    ("rate", "cycles"), [(125.0, 1), (100.0, 1), (62.5, 2), (50.0, 2), (25.0, 5), (10.0, 12), (1.0, 125)]
)
def test_packages_are_even_from_the_first_on(client, robot, rate, cycles):
    client.outputs(b"timestamp", rate)
    for _ in range(2):  # after a pause, too
        client.ask(b"S")
        client.sent.clear()
        came = []
        for i in range(400):
            client.session.tick()
            came += [i] * len(client.sent)
            client.sent.clear()
        assert came == list(range(0, 400, cycles))
        client.ask(b"P")


@pytest.mark.parametrize("rate", [0.0, -1.0, 0.9, 125.1, 500.0, float("nan"), float("inf")])
def test_an_impossible_rate_is_refused(client, rate):
    assert client.outputs(b"timestamp", rate)[:1] == b"\0"


# As UR's guide has them: the first software, outputs, inputs.
FIELDS = (
    ((3, 5), "elbow_position elbow_velocity input_int_register_23 output_bit_registers32_to_63 tool_output_mode",
     "external_force_torque input_double_register_23 speed_slider_mask input_bit_registers0_to_31"),
    ((3, 9), "input_bit_register_64 output_int_register_24 output_double_register_47 input_double_register_24",
     "input_bit_register_127 input_int_register_24 input_double_register_47"),
    ((3, 10), "safety_status", ""),
    ((3, 11), "payload payload_cog", ""),
    ((3, 12), "tcp_offset", ""),
    ((3, 14), "script_control_line", ""),
    ((3, 15), "payload_inertia joint_position_deviation_ratio", ""),
    ((9, 9), "ft_raw_wrench collision_detection_ratio time_scale_source", "speed_slider"),
)  # fmt: skip


@pytest.mark.parametrize("minor", range(5, 16))
def test_fields_are_those_of_the_software(new_robot, minor):
    for since, outputs, inputs in FIELDS:
        one = Client(new_robot(version=(3, minor, 0, 1)))
        one.ask(b"V", b"\0\2")
        answers = [one.outputs(name.encode())[1:] for name in outputs.split()]
        answers += [one.ask(b"I", name.encode())[1:] for name in inputs.split()]
        assert [answer != b"NOT_FOUND" for answer in answers] == [since <= (3, minor)] * len(answers), since


def test_new_fields_have_their_values(new_robot):
    robot = new_robot(version=(3, 15, 8, 106339))
    robot.run("def p():\nset_tcp(p[0, 0, 0.1, 0, 0, 0])\nset_target_payload(1, [0, 0, 0.2], [1, 2, 3, 0, 0, 0])\n"
              "speedj([0, 0.5, 0, 0, 0, 0], 5, 0.5)\nend\n", seconds=0.4)  # fmt: skip
    c = robot.controller
    assert OUTPUTS["tcp_offset"].read(c) == [0, 0, 0.1, 0, 0, 0]
    assert OUTPUTS["payload_inertia"].read(c) == [1, 2, 3, 0, 0, 0]
    lag = abs(c.arm.target_q[1] - c.arm.q[1])
    assert OUTPUTS["joint_position_deviation_ratio"].read(c) == pytest.approx(lag / 0.2)


def test_inputs_have_one_owner_until_it_leaves(robot):
    taken = {}
    one, two = Client(robot, taken), Client(robot, taken)
    assert one.ask(b"I", b"input_int_register_0,") == b"\1INT32"
    assert one.ask(b"I", b"input_int_register_0,input_double_register_0") == b"\2INT32,DOUBLE"
    assert two.ask(b"I", b"input_int_register_0,input_int_register_1") == b"\0IN_USE,INT32"
    one.session.close()
    assert two.ask(b"I", b"input_int_register_0") == b"\1INT32"


def test_inputs_arrive_masks_first(client, robot):
    memory = robot.controller.memory
    assert client.ask(b"I", b"standard_digital_output,standard_digital_output_mask") == b"\1UINT8,UINT8"
    assert client.ask(b"I", b"speed_slider_mask,speed_slider_fraction") == b"\2UINT32,DOUBLE"
    assert (
        client.ask(b"I", b"input_int_register_3,input_bit_register_64,input_bit_registers0_to_31")
        == b"\3INT32,BOOL,UINT32"
    )
    assert (
        client.ask(
            b"I",
            b"standard_analog_output_mask,standard_analog_output_type,standard_analog_output_0,standard_analog_output_1",
        )[:1]
        == b"\4"
    )
    client.ask(b"S")
    client.send(1, "BB", 0b11111111, 0b101)
    assert memory.io.digital_out == 0b101
    client.send(2, "Id", 1, 0.25)
    client.send(2, "Id", 0, 0.9)
    assert robot.controller.slider == 0.25
    client.send(3, "i?I", -5, True, 6)
    assert (memory.inputs.ints[3], memory.inputs.bits[64], memory.inputs.bits[1:3]) == (-5, True, [True, True])
    client.send(4, "BBdd", 0b11, 0b01, 0.5, 0.5)
    assert memory.io.analog_out == [5.0, pytest.approx(0.012)]
    client.send(2, "Id", 1, float("nan"))
    assert robot.controller.slider == 0.25


def test_wrong_data_packages_are_answered_not_obeyed(client, robot):
    client.ask(b"I", b"input_int_register_0")
    client.ask(b"S")
    for recipe, form, values in ((9, "i", (7,)), (1, "h", (7,)), (1, "", ())):
        assert b"fits no input recipe" in client.send(recipe, form, *values)
    assert robot.controller.memory.inputs.ints[0] == 0
    assert client.send(1, "id", 7, 1.0) == b""
    assert robot.controller.memory.inputs.ints[0] == 7


@given(st.lists(st.binary(max_size=40), max_size=8))
@settings(max_examples=300)
def test_any_bytes_are_survived(pieces):
    robot = Robot()
    client = Client(robot)
    try:
        for piece in pieces:
            client.session.feed(piece)
            client.session.tick()
    except rtde.ProtocolError:
        pass
    robot.controller.cycle()


@given(st.sampled_from(sorted("VvMOISPU")), st.binary(max_size=60))
@settings(max_examples=300)
def test_any_payload_of_a_known_package_is_survived(kind, payload):
    client = Client(Robot())
    client.ask(b"V", b"\0\2")
    client.ask(b"I", b"input_int_register_0")
    client.ask(b"S")
    try:
        client.session.feed(struct.pack(">H", 3 + len(payload)) + kind.encode() + payload)
        client.session.tick()
    except rtde.ProtocolError:
        pass


def test_every_field_can_be_read_and_packed(robot):
    for name, field in OUTPUTS.items():
        value = field.read(robot.controller)
        form = struct.Struct(">" + FORMATS[field.type])
        form.pack(*(value if FORMATS[field.type][0].isdigit() else (value,))), name
    for name, field in INPUTS.items():
        zero = struct.Struct(">" + FORMATS[field.type]).unpack(bytes(struct.calcsize(">" + FORMATS[field.type])))
        field.write(robot.controller, zero if len(zero) > 1 else zero[0]), name


def test_the_realtime_packet_has_ur_s_layout(robot, new_robot):
    robot.run("speedj([0, 0.2, 0, 0, 0, 0], 5, 0.5)\n", seconds=0.3)
    packet, arm = streams.realtime(robot.controller), robot.controller.arm
    assert len(packet) == struct.unpack(">i", packet[:4])[0] == 1108
    assert struct.unpack_from(">6d", packet, 252) == tuple(arm.q)
    assert struct.unpack_from(">6d", packet, 300) == tuple(arm.qd)
    assert struct.unpack_from(">6d", packet, 444) == tuple(arm.pose())
    assert struct.unpack_from(">d", packet, 756) == (7.0,)
    assert struct.unpack_from(">d", packet, 812) == (1.0,)
    assert struct.unpack_from(">d", packet, 1052) == (2.0,)
    assert len(streams.realtime(new_robot(version=(3, 10, 0, 1)).controller)) == 1116


def test_the_state_message_is_made_of_known_parts(robot):
    message = streams.state(robot.controller)
    size, kind = struct.unpack(">iB", message[:5])
    assert (size, kind) == (len(message), 16)
    parts, at = {}, 5
    while at < len(message):
        length, part = struct.unpack_from(">iB", message, at)
        parts[part] = message[at : at + length]
        at += length
    assert {part: len(body) for part, body in parts.items()} == {
        0: 46, 1: 251, 2: 37, 3: 74, 4: 101, 5: 225, 6: 445, 7: 61, 8: 7
    }  # fmt: skip
    assert struct.unpack_from(">6d", parts[4], 5) == tuple(robot.controller.arm.pose())
    first = messages.version(robot.controller)
    assert struct.unpack(">iB", first[:5]) == (len(first), 20)


@pytest.mark.parametrize(("minor", "size"), [(5, 74), (13, 74), (14, 75), (15, 75)])
def test_the_master_board_s_part_grew_with_software_3_14(new_robot, minor, size):
    message, at, sizes = streams.state(new_robot(version=(3, minor, 0, 1)).controller), 5, {}
    while at < len(message):
        length, part = struct.unpack_from(">iB", message, at)
        sizes[part] = length
        at += length
    assert at == len(message)
    assert sizes[3] == size


@pytest.mark.parametrize(("notice", "kind", "body"), [
    (Notice("text", "Grüße"), 0, "Grüße".encode()),
    (Notice("label", "MoveJ", number=7), 1, b"\0\0\0\x07MoveJ"),
    (Notice("safety", number=3), 5, bytes(8) + b"\x03" + bytes(8)),
    (Notice("error", "bad"), 6, bytes(8) + b"\0\0\0\x02" + bytes(8) + b"bad"),
    (Notice("error", "stop", number=209), 6, b"\0\0\0\xd1\0\0\0\0\0\0\0\x02" + bytes(8) + b"stop"),
    (Notice("started", "mine"), 7, bytes(8) + b"\x13PROGRAM_XXX_STARTEDmine"),
    (Notice("stopped", ""), 7, bytes(8) + b"\x13PROGRAM_XXX_STOPPED"),
    (Notice("exception", "runtime error", 2, 5), 10, b"\0\0\0\x02\0\0\0\x05runtime error"),
])  # fmt: skip
def test_messages_have_ur_s_layout(robot, notice, kind, body):
    packet = messages.message(robot.controller, notice)
    assert struct.unpack(">iBQbb", packet[:15]) == (len(packet), 20, 0, -2, kind)
    assert packet[15:] == body


def test_a_program_that_does_not_compile_has_ur_s_word_and_ours(robot):
    said = []
    robot.controller.outlets.append(said.append)
    with pytest.raises(ScriptError) as refused:
        robot.compile("def f():\n  fly()\nend\n")
    robot.controller.refuse(refused.value)
    packet = messages.message(robot.controller, said[-1])
    size = struct.unpack(">i", packet[:4])[0]
    assert packet[15:size] == struct.pack(">ii", 2, 3) + b"compile_error_name_not_found:fly:"
    assert packet[size + 15 :] == b"line 2: no function 'fly'"


@pytest.fixture
def panel(robot):
    sent = []
    programs = {"wave.script": "def wave():\nwhile True:\nsync()\nend\nend\n", "bad.script": "fly()\n"}
    refused = {"box.urp": "a box", "cell.installation": "an installation", "x.variables": "variables"}
    session = dashboard.DashboardSession(
        robot.controller, sent.append, programs=programs, refused=refused, compile=robot.compile
    )
    assert sent.pop() == b"Connected: Universal Robots Dashboard Server\n"

    def ask(line):
        session.feed(line.encode() + b"\n")
        return sent.pop().decode().rstrip("\n")

    return ask


def test_the_dashboard_s_answers(panel, robot):
    c = robot.controller
    for line, answer in (
        ("robotmode", "Robotmode: RUNNING"), ("safetymode", "Safetymode: NORMAL"),
        ("running", "Program running: false"), ("programState", "STOPPED <unnamed>"),
        ("PolyscopeVersion", "URSoftware 3.9.1.64192 (Jan 01 2019)"),
        ("get robot model", "UR10"), ("play", "Failed to execute: play"), ("pause", "Failed to execute: pause"),
        ("load box.urp", "Error while loading program: box.urp: a box"),
        ("load none.urp", "File not found: none.urp"), ("load", "File not found: "),
        ("load x.variables", "Error while loading program: x.variables: variables"),
        ("load cell.installation", "Error while loading program: cell.installation: an installation"),
        ("load other/wave.script", "File not found: other/wave.script"),
        ("load /programs/../wave.script", "File not found: /programs/../wave.script"),
        ("load installation cell.installation", "Loading installation: cell.installation"),
        ("load installation default.installation", "Loading installation: default.installation"),
        ("load installation none.installation", "File not found: none.installation"),
        ("load installation", "File not found: "),
        ("load installation wave.script", "Failed to load installation: wave.script"),
        ("load installation x.variables", "Failed to load installation: x.variables"),
        ("get loaded program", "No program loaded"),
        ("load wave.script", "Loading program: wave.script"),
        ("get loaded program", "Loaded program: /programs/wave.script"),
        ("play", "Starting program"), ("popup hello", "showing popup"), ("close popup", "closing popup"),
        ("close safety popup", "closing safety popup"), ("setUserRole operator", "Setting user role: OPERATOR"),
        ("isProgramSaved", "true wave.script"), ("addToLog x", "Added log message"),
        ("dance", "could not understand: dance"),
        ("is in remote control", "could not understand: is in remote control"),
    ):  # fmt: skip
        assert panel(line) == answer
    assert panel("load bad.script").startswith("Error while loading program: bad.script")
    for folder in ("/programs", "/ursim/programs", "."):
        assert panel(f"load {folder}/wave.script") == f"Loading program: {folder}/wave.script"
    assert panel("play") == "Starting program"
    robot.wait(0.05)
    assert panel("running") == "Program running: true"
    assert panel("programstate") == "PLAYING wave.script"
    assert panel("pause") == "Pausing program"
    assert panel("programState") == "PAUSED wave.script"
    assert panel("play") == "Starting program"
    assert panel("stop") == "Stopped"
    c.protective_stop("test")
    assert panel("safetymode") == "Safetymode: PROTECTIVE_STOP"
    assert panel("unlock protective stop").startswith("Cannot unlock")
    robot.wait(5.1)
    assert panel("unlock protective stop") == "Protective stop releasing"
    assert panel("power off") == "Powering off"
    assert c.robot_mode == POWER_OFF
    assert panel("power on") == "Powering on"
    assert panel("brake release") == "Brake releasing"
    robot.wait(2.5)
    assert panel("robotmode") == "Robotmode: RUNNING"
    assert panel("quit") == "Disconnected"


@pytest.mark.parametrize(("line", "since", "answer"), [
    ("saveLog", 13, "Log saved to disk"), ("safetystatus", 10, "Safetystatus: NORMAL"),
    ("generate flight report system", 13, "Flight Report generated with id: 0"),
    ("generate support file .", 13, "Completed successfully: ur_20183000000.zip"),
    ("restart safety", 7, "Restarting safety"),
])  # fmt: skip
def test_commands_of_the_dashboard_are_those_of_the_software(new_robot, line, since, answer):
    for minor in (since - 1, since):
        robot, sent = new_robot(version=(3, minor, 0, 1)), []
        session = dashboard.DashboardSession(robot.controller, sent.append, programs={}, compile=robot.compile)
        session.feed(line.encode() + b"\n")
        assert sent[-1].decode() == (f"{answer}\n" if minor == since else f"could not understand: {line}\n")


@given(st.binary(max_size=200))
def test_the_dashboard_survives_any_bytes(data):
    robot, sent = Robot(), []
    session = dashboard.DashboardSession(robot.controller, sent.append, programs={}, compile=robot.compile)
    session.feed(data + b"\n")
