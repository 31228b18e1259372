"""Sends mutated RTPS packets to sdg ros2 and checks that the node keeps working with an honest peer.

python rtps_attack.py SDG FOLDER [PACKETS]: needs root, because the packets are recorded on the loopback interface.

A second process (`--attack`) joins as a peer, records its own packets to the node, and sends mutated copies of them. The
copies have the identity of that peer, so that they reach the readers and writers that are matched with it.
"""

import collections
import pathlib
import random
import socket
import struct
import subprocess
import sys
import time

from cyclone import Peer, best_effort, make, pack, reliable, transient_local, unpack
from node_tests import CAMERA, Sdg, check, failures, header, image, photo, send_at, teach

DOMAIN = 47
PACKETS = 100_000
BATCH = 5_000
"""Number of packets between two tests of the node."""
MAX_QUEUE_BYTES = 200_000
"""The attacker waits while more bytes are waiting in a socket: a packet that the kernel drops tests nothing."""
MAX_GROWTH_MB = 128
MAX_SEEDS_OF_A_KIND = 12
EXTREMES = [0, 1, 0x7F, 0xFF, 0x7FFF, 0xFFFF, 0x7FFF_FFFF, 0xFFFF_FFFF, 0x7FFF_FFFF_FFFF_FFFF, 0xFFFF_FFFF_FFFF_FFFF]
RTPS_HEADER = 20
PAD, ACKNACK, HEARTBEAT, GAP, INFO_TS, NACK_FRAG, DATA_FRAG = 0x01, 0x06, 0x07, 0x08, 0x09, 0x12, 0x16
MAX_NUMBERS = 100_000
MAX_SAMPLE_BYTES = 16 << 20


def submessages(packet):
    """The submessages of a packet, as kind, flags and content."""
    at, found = RTPS_HEADER, []
    while at + 4 <= len(packet):
        kind, flags = packet[at], packet[at + 1]
        (length,) = struct.unpack_from("<H" if flags & 1 else ">H", packet, at + 2)
        # A length of 0 means "to the end of the packet", except for these two.
        end = at + 4 + length if length or kind in (PAD, INFO_TS) else len(packet)
        found.append((kind, flags, packet[at + 4 : end]))
        at = end
    return found


def packet_of(head, parts):
    packed = [
        bytes([kind, flags]) + struct.pack("<H" if flags & 1 else ">H", min(len(content), 0xFFFF)) + content
        for kind, flags, content in parts
    ]
    return head + b"".join(packed)


def mutated(content, other, rng):
    """The bytes with one to six mistakes."""
    content = bytearray(content or b"\0")
    for _ in range(min(6, 1 + int(rng.expovariate(1.0)))):
        if not content:
            content = bytearray(b"\0")
        at = rng.randrange(len(content))
        end = min(len(content), at + rng.randrange(1, 33))
        mistake = rng.randrange(8)
        if mistake == 0:
            content[at] ^= 1 << rng.randrange(8)
        elif mistake == 1:
            content[at] = rng.randrange(256)
        elif mistake == 2:
            del content[at:]
        elif mistake == 3:
            del content[at:end]
        elif mistake == 4:
            content[at:at] = content[at:end]
        elif mistake in (5, 6):
            # Integers of RTPS are aligned to four bytes.
            size = rng.choice([1, 2, 4, 8])
            at &= ~(min(size, 4) - 1)
            number = (rng.choice(EXTREMES) % (1 << 8 * size)).to_bytes(size, "little")
            content[at : at + size] = number[: len(content) - at]
        elif other:
            start = rng.randrange(len(other))
            content[at:end] = other[start : start + rng.randrange(1, 129)]
    return bytes(content)


def attack_packet(seeds, rng):
    """A destination and a mutated packet: in most cases one submessage has mistakes and its length is correct."""
    destination, packet = rng.choice(seeds)
    parts = submessages(packet)
    other = rng.choice(seeds)[1]
    if not parts or rng.random() < 0.2:
        return destination, mutated(packet, other, rng)[:65000]
    which = rng.randrange(len(parts))
    kind, flags, content = parts[which]
    if rng.random() < 0.1:
        kind, flags = rng.choice([(rng.randrange(256), flags), (kind, rng.randrange(256))])
    foreign = submessages(other)
    parts[which] = (kind, flags, mutated(content, rng.choice(foreign)[2] if foreign else b"", rng))
    if rng.random() < 0.2:
        parts.append(rng.choice(parts + foreign))
    return destination, packet_of(packet[:RTPS_HEADER], parts)[:65000]


def is_known(packet):
    """Whether the packet uses a known fault of RustDDS 0.15.1 (docs/testing.md): RustDDS stores each number between the
    two of a heartbeat or a gap, allocates a sample's announced size and as many bits as the number of a requested
    fragment, and panics if that number is zero."""
    for kind, flags, content in submessages(packet):
        order = "<" if flags & 1 else ">"
        if kind in (HEARTBEAT, GAP) and len(content) >= 24:
            first_high, first_low, last_high, last_low = struct.unpack_from(order + "iIiI", content, 8)
            if ((last_high - first_high) << 32) + last_low - first_low > MAX_NUMBERS or last_high == 0x7FFF_FFFF:
                return True
        if kind == NACK_FRAG and len(content) >= 24:
            (base,) = struct.unpack_from(order + "I", content, 16)
            if not 1 <= base <= MAX_NUMBERS:
                return True
        if kind == DATA_FRAG and len(content) >= 32:
            if struct.unpack_from(order + "I", content, 28)[0] > MAX_SAMPLE_BYTES:
                return True
    return False


def with_nack_frag(packet, base):
    """The packet with its ACKNACK as a NACK_FRAG for the fragment `base` of the first message; `None` if it has none."""
    for kind, flags, content in submessages(packet):
        if kind == ACKNACK and flags & 1:
            request = content[:8] + struct.pack("<iIIIII", 0, 1, base, 1, 1 << 31, 1)
            destined = [part for part in submessages(packet) if part[0] not in (ACKNACK, HEARTBEAT)]
            return packet_of(packet[:RTPS_HEADER], [*destined, (NACK_FRAG, flags, request)])
    return None


def recorded(listener, prefix, seconds):
    """The packets of the participant with this prefix that arrive within this time, with their destinations; of each
    kind only the first ones."""
    end, seeds, counts = time.monotonic() + seconds, [], collections.Counter()
    while time.monotonic() < end:
        try:
            frame, address = listener.recvfrom(70_000)
        except TimeoutError:
            continue
        # The loopback interface shows each packet as outgoing, then as incoming. Ethernet and IPv4 headers come first.
        if address[2] == socket.PACKET_OUTGOING or len(frame) < 42 or frame[12:14] != b"\x08\0" or frame[23] != 17:
            continue
        udp = 14 + 4 * (frame[14] & 15)
        payload = frame[udp + 8 :]
        if payload[:4] != b"RTPS" or payload[8:20] != prefix:
            continue
        destination = (socket.inet_ntoa(frame[30:34]), struct.unpack_from(">H", frame, udp + 2)[0])
        kind = (destination, tuple(part[0] for part in submessages(payload)))
        counts[kind] += 1
        if counts[kind] <= MAX_SEEDS_OF_A_KIND:
            seeds.append((destination, payload))
    return seeds


def waiting_bytes(ports):
    """The largest number of bytes that wait in a socket of these ports."""
    lines = [line.split() for line in pathlib.Path("/proc/net/udp").read_text().splitlines()[1:]]
    return max((int(line[4].split(":")[1], 16) for line in lines if int(line[1].split(":")[1], 16) in ports), default=0)


def attack(domain, count):
    """Joins, records, and sends mutated packets; prints the number of packets after each batch and then waits for a
    line on standard input."""
    listener = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(3))
    listener.bind(("lo", 0))
    listener.settimeout(0.2)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 8 << 20)
    peer = Peer(domain)
    prefix = bytes(peer.participant.guid.bytes)[:12]
    send = peer.writer("/image", "sensor_msgs/msg/Image", reliable(10))
    rough = peer.writer("/camera_info", "sensor_msgs/msg/CameraInfo", best_effort(10))
    move = peer.writer("/tf_static", "tf2_msgs/msg/TFMessage", transient_local(10))
    kept = [peer.raw_reader("/sdg/detections", "vision_msgs/msg/Detection2DArray", reliable(10))]
    client = peer.client("/sdg/detect_trigger", "std_srvs/Trigger", "std_srvs/Trigger")
    time.sleep(1.0)
    small = pack(image(photo()[::40, ::40]), "sensor_msgs/msg/Image")
    transform = make("geometry_msgs/msg/TransformStamped", header=header("a"), child_frame_id="b")
    for number in range(6):
        send(small if number else pack(image(photo()), "sensor_msgs/msg/Image"))
        rough(make("sensor_msgs/msg/CameraInfo", header=header("camera")))
        move(make("tf2_msgs/msg/TFMessage", transforms=[transform]))
        client.send(b"")
        time.sleep(0.1)
        kept[0]()
    seeds = recorded(listener, prefix, 3.0)
    # Cyclone requests fragments only if some were lost.
    requests = [(place, with_nack_frag(packet, 1)) for place, packet in seeds]
    seeds += [request for request in requests if request[1]]
    kinds = sorted({f"{part[0]:#04x}" for _, packet in seeds for part in submessages(packet)})
    ports = {port for (_, port), _ in seeds}
    print(f"recorded {len(seeds)} packets to ports {sorted(ports)}, submessages {' '.join(kinds)}", flush=True)
    # The recording's socket would make the kernel copy each packet.
    listener.close()
    rng = random.Random(1)
    attacker = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    attacker.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton("127.0.0.1"))
    for number in range(1, count + 1):
        destination, packet = attack_packet(seeds, rng)
        while is_known(packet):
            destination, packet = attack_packet(seeds, rng)
        attacker.sendto(packet, destination)
        if number % 50 == 0:
            while waiting_bytes(ports) > MAX_QUEUE_BYTES:
                time.sleep(0.001)
        if number % BATCH == 0:
            print(number, flush=True)
            sys.stdin.readline()


def main(sdg, folder, count):
    model = teach(sdg, folder, f"--camera={CAMERA}", "--mark-height-mm=16")
    with Sdg(sdg, DOMAIN, f"--grasp-model={model}", f"--camera={CAMERA}", "--reliable") as node:

        def works(what, seconds=20):
            """Whether a peer in a process of its own gets a detection."""
            command = [sys.executable, __file__, "--honest", str(seconds)]
            done = subprocess.run(command, capture_output=True, text=True)
            is_running = node.process.poll() is None
            memory = f"{node.rss_mb():.0f} MB" if is_running else "ended"
            said = (done.stdout + done.stderr).strip().splitlines()[-1:]
            check(done.returncode == 0, f"{what}: {' '.join(said)}, node {memory}")
            return is_running

        works("before")
        before = node.rss_mb()
        command = [sys.executable, __file__, "--attack", str(count)]
        # Cyclone prints each mutated packet that it rejects.
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
        attacker = subprocess.Popen(command, text=True, **pipes)
        print("      " + attacker.stdout.readline().strip(), flush=True)
        begun = time.monotonic()
        for line in attacker.stdout:
            if not works(f"after {int(line):,} packets"):
                break
            attacker.stdin.write("\n")
            attacker.stdin.flush()
        else:
            check(attacker.wait() == 0, f"the attacker ended; {time.monotonic() - begun:.0f} s")
            works("after the attack")
            check(node.rss_mb() < before + MAX_GROWTH_MB, f"memory: {before:.0f} MB before, {node.rss_mb():.0f} MB after")
        attacker.kill()
    for line in node.lines[-20:]:
        print("      " + line[:300], flush=True)
    print(f"{len(failures)} failures", flush=True)
    return bool(failures)


def honest(seconds):
    """Sends pictures until a detection arrives."""
    peer = Peer(DOMAIN)
    send = peer.writer("/image", "sensor_msgs/msg/Image", reliable(10))
    detections = peer.raw_reader("/sdg/detections", "vision_msgs/msg/Detection2DArray", reliable(100))
    begun = time.monotonic()
    while time.monotonic() < begun + seconds:
        send_at(send, photo(), 10, 1)
        time.sleep(0.2)
        found = [unpack(data, "vision_msgs/msg/Detection2DArray") for data in detections()]
        if any(len(message.detections) == 1 for message in found):
            print(f"a detection after {time.monotonic() - begun:.1f} s")
            return 0
    print(f"no detection within {seconds} s")
    return 1


if __name__ == "__main__":
    if sys.argv[1] == "--attack":
        sys.exit(attack(DOMAIN, int(sys.argv[2])))
    if sys.argv[1] == "--honest":
        sys.exit(honest(float(sys.argv[2])))
    sys.exit(main(sys.argv[1], pathlib.Path(sys.argv[2]), int(sys.argv[3]) if len(sys.argv) > 3 else PACKETS))
