"""Topics and services of ROS 2 over Cyclone DDS, encoded by rosbags: a peer that is independent of this project's
code."""

import dataclasses
import os
import time

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import uint8
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration
from message_bytes import typestore

LOOPBACK = (
    "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name='lo' multicast='true'/></Interfaces>"
    "<MaxMessageSize>65500B</MaxMessageSize></General>"
    "<Discovery><ParticipantIndex>auto</ParticipantIndex></Discovery></Domain></CycloneDDS>"
)
STORE = typestore()
ENCODING = b"\0\1\0\0"


def reliable(depth):
    return Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepLast(depth))


def best_effort(depth):
    return Qos(Policy.Reliability.BestEffort, Policy.History.KeepLast(depth))


def transient_local(depth):
    return Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepLast(depth),
               Policy.Durability.TransientLocal)


def raw_type(type_name):
    """A type with this name whose samples are the bytes on the network, without the four bytes of the encoding."""

    @dataclasses.dataclass
    class Raw(IdlStruct, typename=type_name):
        # Cyclone checks only the first byte of a sample and passes the others on.
        first: uint8

        def serialize(self, *_, **__):
            return ENCODING + self.data

        @classmethod
        def deserialize(cls, data, *_, **__):
            return sample_of(cls, bytes(data)[4:])

    return Raw


def sample_of(raw, data):
    sample = raw(first=0)
    sample.data = data
    return sample


def dds_type(name):
    """The DDS name of a type such as sensor_msgs/msg/Image."""
    package, kind, message = name.split("/")
    return f"{package}::{kind}::dds_::{message}_"


def pack(message, name):
    return bytes(STORE.serialize_cdr(message, name))[4:]


def unpack(data, name):
    return STORE.deserialize_cdr(ENCODING + data, name)


def make(type_name, /, **fields):
    """A message with these fields; the others are empty."""
    empty = {"string": "", "bool": False}
    values = []
    for field, (kind, details) in STORE.get_msgdef(type_name).fields:
        if field in fields:
            values.append(fields.pop(field))
        elif kind.name == "BASE":
            values.append(empty.get(details[0], 0.0 if details[0].startswith("float") else 0))
        elif kind.name == "NAME":
            values.append(make(details))
        elif kind.name == "ARRAY":
            import numpy
            values.append(numpy.zeros(details[1], dtype=details[0][1][0]))
        else:
            element = details[0]
            if element[0].name == "BASE" and element[1][0] != "string":
                import numpy
                values.append(numpy.zeros(0, dtype={"octet": "uint8", "byte": "uint8"}.get(element[1][0], element[1][0])))
            else:
                values.append([])
    assert not fields, fields
    return STORE.types[type_name](*values)


def stamp_now():
    nanos = time.time_ns()
    return make("builtin_interfaces/msg/Time", sec=nanos // 10**9, nanosec=nanos % 10**9)


def header(frame, stamp=None):
    return make("std_msgs/msg/Header", stamp=stamp or stamp_now(), frame_id=frame)


class Peer:
    """A participant on loopback."""

    def __init__(self, domain):
        os.environ.setdefault("CYCLONEDDS_URI", LOOPBACK)
        self.participant = DomainParticipant(domain)

    def writer(self, topic, name, qos):
        raw = raw_type(dds_type(name))
        writer = DataWriter(self.participant, Topic(self.participant, "rt" + topic, raw), qos=qos)
        return lambda message: writer.write(sample_of(raw, message if isinstance(message, bytes) else pack(message, name)))

    def reader(self, topic, name, qos):
        raw = raw_type(dds_type(name))
        reader = DataReader(self.participant, Topic(self.participant, "rt" + topic, raw), qos=qos)
        return lambda: [unpack(sample.data, name) for sample in reader.take(1000) if hasattr(sample, "data")]

    def raw_reader(self, topic, name, qos):
        raw = raw_type(dds_type(name))
        reader = DataReader(self.participant, Topic(self.participant, "rt" + topic, raw), qos=qos)
        return lambda: [sample.data for sample in reader.take(1000) if hasattr(sample, "data")]

    def client(self, service, request, response, kind="srv"):
        return Client(self.participant, service, request, response, kind)


class Client:
    """A service's client as in rmw_cyclonedds_cpp: half of the client's identifier and a number precede the content."""

    def __init__(self, participant, service, request, response, kind):
        package, name = request.split("/")
        self.request = raw_type(f"{package}::{kind}::dds_::{name}_Request_")
        self.response = raw_type(f"{package}::{kind}::dds_::{name}_Response_")
        qos = reliable(10)
        self.writer = DataWriter(participant, Topic(participant, f"rq{service}Request", self.request), qos=qos)
        self.reader = DataReader(participant, Topic(participant, f"rr{service}Reply", self.response), qos=qos)
        self.half = bytes(self.writer.guid.bytes)[8:]
        self.number = 0
        del response

    def send(self, content):
        self.number += 1
        self.writer.write(sample_of(self.request, self.half + self.number.to_bytes(8, "little") + content))
        return self.number

    def call(self, content, timeout=10.0):
        """The answer's bytes (None without an answer) and the seconds of waiting."""
        number, begun = self.send(content), time.monotonic()
        while time.monotonic() < begun + timeout:
            for sample in self.reader.take(100):
                if hasattr(sample, "data") and sample.data[:16] == self.half + number.to_bytes(8, "little"):
                    return sample.data[16:], time.monotonic() - begun
            time.sleep(0.001)
        return None, time.monotonic() - begun


class Server:
    """A service's server, for the three services of an action."""

    def __init__(self, participant, service, package, name, kind):
        self.request = raw_type(f"{package}::{kind}::dds_::{name}_Request_")
        self.response = raw_type(f"{package}::{kind}::dds_::{name}_Response_")
        qos = reliable(10)
        self.reader = DataReader(participant, Topic(participant, f"rq{service}Request", self.request), qos=qos)
        self.writer = DataWriter(participant, Topic(participant, f"rr{service}Reply", self.response), qos=qos)

    def requests(self):
        return [(sample.data[:16], sample.data[16:]) for sample in self.reader.take(100) if hasattr(sample, "data")]

    def answer(self, head, content):
        self.writer.write(sample_of(self.response, head + content))
