#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""kerf-bridge behind a reverse proxy that ends TLS and shows it at https://lab.example:PORT/rooms/kerf/: the page, its
files and its socket, and a join. The proxy is one of each kind: it removes its path or not, it keeps the name in Host
or not.

    proxy_test.py FOLDER_OF_PROGRAMS"""
import http.client
import os
import pathlib
import re
import select
import socket
import ssl
import subprocess
import sys
import tempfile
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).parent.parent / "support"))
import lack

NAME, PATH, TOKEN = "lab.example", "/rooms/kerf", "a-token-of-the-proxy-test"


class Proxy(threading.Thread):
    """One request a connection, and both directions after it."""

    def __init__(self, tls, strips, keeps_host):
        super().__init__(daemon=True)
        self.tls, self.strips, self.keeps_host, self.to = tls, strips, keeps_host, None
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.port = self.listener.getsockname()[1]
        self.start()

    def run(self):
        while True:
            threading.Thread(target=self.serve, args=self.listener.accept()[:1], daemon=True).start()

    def serve(self, client):
        try:
            with self.tls.wrap_socket(client, server_side=True) as near, socket.create_connection(("127.0.0.1", self.to)) as far:
                head = b""
                while b"\r\n\r\n" not in head:
                    head += near.recv(1) or b"\r\n\r\n"
                if self.strips:
                    head = head.replace(PATH.encode(), b"", 1)
                if not self.keeps_host:
                    head = re.sub(rb"\r\nHost: [^\r]*", b"\r\nHost: 127.0.0.1:%d" % self.to, head, count=1)
                far.sendall(head)
                while True:  # in one thread: OpenSSL allows no other
                    for one in [near] if near.pending() else select.select([near, far], [], [])[0]:
                        part = one.recv(65536)
                        if not part:
                            return
                        (far if one is near else near).sendall(part)
        except OSError:
            pass


def check(what, seen):
    if not seen:
        sys.exit(f"proxy_test: {what}")


def through(proxy, bridge, ca):
    kind = f"(removes its path: {proxy.strips}, keeps Host: {proxy.keeps_host}) "

    def get(path, **headers):
        link = http.client.HTTPSConnection("127.0.0.1", proxy.port, context=ca, timeout=20)
        link.request("GET", path, headers={"Host": f"{NAME}:{proxy.port}", "Connection": "close", **headers})
        return link, link.getresponse()

    def said(pattern, seconds=20):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            with open(bridge) as log:
                if found := re.search(pattern, log.read()):
                    return found
            time.sleep(0.02)
        sys.exit(f"proxy_test: {kind}the bridge did not say {pattern}")

    check(kind + "join's address is the proxy's", said(rf"wss://{NAME}:{proxy.port}{PATH}/\?token={TOKEN}\n"))
    page = said(rf"https://{NAME}:{proxy.port}({PATH}/\?token=\w+)\n")[1]
    _, answer = get(page)
    check(kind + f"the page is there: {answer.status}", answer.status == 200)
    cookie = answer.getheader("Set-Cookie")
    check(kind + f"its cookie is good for its folder: {cookie}", "Path=" not in cookie)
    check(kind + "no address of the page leaves its folder", not re.search(rb'(src|href)="(/|http)', answer.read()))
    cookie = {"Cookie": cookie.split(";")[0]}
    check(kind + "so are its files", get(f"{PATH}/kerf.js", **cookie)[1].status == 200)
    upgrade = {**cookie, "Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Version": "13",
               "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ=="}
    for origin, status in ((f"https://{NAME}:{proxy.port}", 101), ("https://evil.example", 403)):
        _, answer = get(f"{PATH}/bridge", Origin=origin, **upgrade)
        check(kind + f"its socket, from {origin}: {answer.status}", answer.status == status)
    if not proxy.strips:
        _, answer = get(PATH + "?token=x")
        check(kind + f"the path without a slash leads there: {answer.status}",
              (answer.status, answer.getheader("Location")) == (308, PATH + "/?token=x"))


def main():
    programs = sys.argv[1]
    with tempfile.TemporaryDirectory() as folder:
        def path(name):
            return os.path.join(folder, name)

        os.environ["XDG_RUNTIME_DIR"] = folder
        subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "group:P-256", "-noenc", "-subj", "/CN=proxy",
                        "-addext", f"subjectAltName=DNS:{NAME},DNS:localhost,IP:127.0.0.1", "-keyout", path("key.pem"),
                        "-out", path("cert.pem")], check=True, stderr=subprocess.DEVNULL)
        with open(path("tokens"), "w", opener=lambda p, f: os.open(p, f, 0o600)) as tokens:
            tokens.write(TOKEN + "\n")
        tls = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        tls.load_cert_chain(path("cert.pem"), path("key.pem"))
        ca = ssl.create_default_context(cafile=path("cert.pem"))
        for strips, keeps_host in ((False, True), (True, True), (False, False), (True, False)):
            proxy = Proxy(tls, strips, keeps_host)
            with socket.create_server(("127.0.0.1", 0)) as free:
                proxy.to = free.getsockname()[1]
            log = path(f"bridge-{strips}-{keeps_host}.log")
            with open(log, "w") as out:
                bridge = subprocess.Popen([os.path.join(programs, "kerf-bridge"), "serve", "--listen", f"127.0.0.1:{proxy.to}",
                                           "--token-file", path("tokens"), "--public-url", f"https://{NAME}:{proxy.port}{PATH}/"],
                                          stdout=out, stderr=out)
            try:
                through(proxy, log, ca)
                join = subprocess.run([os.path.join(programs, "kerf-bridge"), "join", "--ca", path("cert.pem"), "--wait", "3",
                                       f"wss://localhost:{proxy.port}{PATH}/?token={TOKEN}"], capture_output=True, text=True, check=False)
                check(f"a join comes through: {join}", join.returncode == 2 and "has no controller yet; gave up" in join.stderr)
            finally:
                bridge.terminate()
                bridge.wait()
    print("proxy_test: fine")


lack.need_network()
main()
