"""Remote procedure calls of programs, against Python's own XML-RPC server and against servers that misbehave."""

import contextlib
import re
import socket
import threading
from xmlrpc.server import SimpleXMLRPCRequestHandler, SimpleXMLRPCServer

import pytest


class Quiet(SimpleXMLRPCRequestHandler):
    rpc_paths = ("/RPC2",)


class Camera:
    """What a program calls."""

    def __init__(self):
        self.given = []

    def initialize(self, kind):
        return kind == "RGB"

    def echo(self, value):
        self.given.append(value)
        return value

    def count(self, *values):
        return len(values)

    def fails(self):
        raise RuntimeError("no light")

    def strange(self):
        return {"a": 1}


@pytest.fixture
def camera():
    one = Camera()
    with SimpleXMLRPCServer(("127.0.0.1", 0), requestHandler=Quiet, logRequests=False) as server:
        server.register_instance(one)
        thread = threading.Thread(target=server.serve_forever, args=(0.01,))
        thread.start()
        one.url = f"http://127.0.0.1:{server.server_address[1]}/RPC2"
        yield one
        server.shutdown()
        thread.join()


def ask(robot, url, body):
    """Run a program until it ends, in real time where it waits for the server; return what it wrote."""
    c = robot.controller
    c.start(robot.compile(f'def p():\ncamera = rpc_factory("xmlrpc", "{url}")\n{body}\nend\n'))
    robot.wait(0.008)
    for _ in range(100_000):
        if c.program is None:
            break
        c.cycle()
    return [text for kind, text in robot.log if kind == "text"]


@pytest.mark.parametrize(("call", "answer"), [
    ('camera.initialize("RGB")', "True"),
    ("camera.echo(-5)", "-5"),
    ("camera.echo(0.25) + 1", "1.25"),
    ('camera.echo("a < b & c")', "a < b & c"),
    ("camera.echo([1, 2.5, 3])[1]", "2.5"),
    ("camera.echo(p[1, 2, 3, 0.1, 0.2, 0.3])", "p[1, 2, 3, 0.1, 0.2, 0.3]"),
    ("camera.count(1, True, [2])", "3"),
    ("camera.count(camera.count(), 1)", "2"),
])  # fmt: skip
def test_what_a_server_returns(robot, camera, call, answer):
    assert ask(robot, camera.url, f"textmsg({call})\ncamera.closeXMLRPCClientConnection()") == [answer], robot.errors
    assert not robot.errors


def test_a_pose_goes_out_as_its_six_parts(robot, camera):
    ask(robot, camera.url, "camera.echo(p[1, 2, 3, 0.1, 0.2, 0.3])")
    assert camera.given == [{"x": 1.0, "y": 2.0, "z": 3.0, "rx": 0.1, "ry": 0.2, "rz": 0.3}]


@pytest.mark.parametrize(("call", "part"), [
    ("fails()", "fails: <Fault 1: .*no light"),
    ("strange()", "a program has no values like"),
    ("nothing()", "not supported"),
    ("echo(camera)", "no remote procedure takes"),
])  # fmt: skip
def test_a_call_that_goes_wrong_ends_the_program(robot, camera, call, part):
    ask(robot, camera.url, f"x = camera.{call}")
    assert len(robot.errors) == 1
    assert re.search(part, robot.errors[0])


@pytest.mark.parametrize(("reply", "part"), [
    (b"HTTP/1.0 404 Not Found\r\n\r\n", "404 Not Found"),
    (b"HTTP/1.0 200 OK\r\n\r\nnonsense", "no XML-RPC"),
    (b"", "the server answers ''"),
    (b"HTTP/1.0 200 OK\r\n\r\n" + b"x" * 70_000, "the answer is too long"),
])  # fmt: skip
def test_a_server_that_speaks_something_else_ends_the_program(robot, reply, part):
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(5.0)

        def answer():
            link, _ = server.accept()
            with link, contextlib.suppress(OSError):
                link.recv(65536)
                link.sendall(reply)

        thread = threading.Thread(target=answer)
        thread.start()
        ask(robot, f"http://127.0.0.1:{server.getsockname()[1]}/", "x = camera.look()")
        thread.join()
    assert part in robot.errors[-1]


def test_nobody_there_and_other_machines_end_the_program(robot):
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    for url, part in ((f"http://127.0.0.1:{port}", "look: 127.0.0.1"), ("http://192.0.2.1/", "not an address of this")):
        ask(robot, url, "x = camera.look()")
        assert part in robot.errors[-1]


def test_a_secondary_program_has_no_time_for_a_call(robot):
    with socket.create_server(("127.0.0.1", 0)) as server:  # one that never answers
        url = f"http://127.0.0.1:{server.getsockname()[1]}/"
        robot.run(f'sec s():\ncamera = rpc_factory("xmlrpc", "{url}")\nx = camera.count()\nend\n', seconds=0.1)
    assert "a secondary program may not wait" in robot.errors[-1]
