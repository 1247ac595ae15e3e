"""Networks and peers that misbehave, for archive.py."""

import contextlib
import socket
import threading


def listen(port, queue=64):
    server = socket.socket()
    server.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    server.bind(("127.0.0.1", port))
    server.listen(queue)
    return server


class Proxy:
    """Carries bytes between a port and another. A connection is cut when it carried `cut` bytes, both
    ways together; `times` connections are. `then_refuse`: after that the port is closed."""

    def __init__(self, port, target, cut=None, times=0, then_refuse=False):
        self.server, self.target = listen(port), target
        self.cut, self.times, self.then_refuse = cut, times, then_refuse
        self.lock = threading.Lock()

    def __enter__(self):
        threading.Thread(target=self.accept, daemon=True).start()
        return self

    def __exit__(self, *_):
        close(self.server)

    def accept(self):
        with contextlib.suppress(OSError):
            while True:
                client, _ = self.server.accept()
                peer = socket.create_connection(("127.0.0.1", self.target))
                for one in (client, peer):
                    one.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                carried = [0]
                for a, b in [(client, peer), (peer, client)]:
                    arguments = (a, b, carried)
                    threading.Thread(target=self.carry, args=arguments, daemon=True).start()

    def carry(self, a, b, carried):
        with contextlib.suppress(OSError):
            while data := a.recv(65536):
                # Else the sender of half a message waits 40 ms for the acknowledgement, for each object.
                a.setsockopt(socket.IPPROTO_TCP, socket.TCP_QUICKACK, 1)
                with self.lock:
                    carried[0] += len(data)
                    over = self.times > 0 and carried[0] > self.cut
                    if over:
                        self.times -= 1
                        if self.then_refuse:
                            close(self.server)
                if over:
                    break
                b.sendall(data)
        close(a)
        close(b)


def close(one):
    with contextlib.suppress(OSError):
        one.shutdown(socket.SHUT_RDWR)
    one.close()


@contextlib.contextmanager
def peer(port, answer):
    """Answers the first bytes of every connection with `answer`, then keeps it open; gives the list of
    those that came."""
    server, kept = listen(port), []

    def accept():
        with contextlib.suppress(OSError):
            while True:
                client, _ = server.accept()
                kept.append(client)
                client.recv(4096)
                client.sendall(answer)

    threading.Thread(target=accept, daemon=True).start()
    try:
        yield kept
    finally:
        for one in [server, *kept]:
            close(one)


def lying_peer(port):
    """Accepts the association with a unit that declares 4 GB."""
    return peer(port, b"\x02\x00\xff\xff\xff\xff\x00\x01\x00\x00")


def silent_peer(port):
    return peer(port, b"")


@contextlib.contextmanager
def full_peer(port):
    """Lets nobody in: its queue is full, and who knocks hears nothing. Gives a function that says how
    many knock."""
    server = listen(port, 0)
    callers = [socket.socket() for _ in range(4)]
    for caller in callers:
        caller.setblocking(False)
        caller.connect_ex(("127.0.0.1", port))

    def knocking():
        with open("/proc/net/tcp") as table:
            lines = [line.split() for line in table][1:]
        # State 2: SYN sent.
        return sum(line[2].endswith(f":{port:04X}") and line[3] == "02" for line in lines)

    try:
        yield knocking
    finally:
        for one in [server, *callers]:
            close(one)
