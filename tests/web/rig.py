# SPDX-License-Identifier: Apache-2.0
"""A controller with an emulated hand that cuts once and rests, a bridge, and native pictures."""
import os
import re
import subprocess
import time

SCENE = '''[[volume]]
file = "phantom"
size = [96, 96, 64]
iso = 0.45
[[tool]]
name = "ball"
shape = "ball"
size_vox = 8
[[tool]]
name = "fissure"
shape = "cylinder"
radius_mm = 0.5
length_mm = 3.8
[force]
stiffness_n_per_mm = 0.4
[cut]
model = "preston"
machinability_mm3_per_s_n = 30
'''
# Waits for the page, cuts the crown and goes so far away that no tool touches the tooth.
HAND = '''start_mm = [0, 6, 0]
[[step]]
hold = 3.0
[[step]]
move_mm = [0, 0.3, 1.5]
seconds = 0.3
[[step]]
move_mm = [0, -1.5, 1.5]
seconds = 0.4
[[step]]
move_mm = [1.5, -1.5, 3.0]
seconds = 0.6
[[step]]
move_mm = [4, 9, -2]
seconds = 0.5
[[step]]
hold = 3600
'''
# Two teeth beside each other, and a hand that stays away.
TWO_TEETH = '''[[volume]]
name = "molar"
file = "phantom"
size = [64, 64, 48]
iso = ISO
crop = false  # which the iso value decides
[[volume]]
name = "neighbour"
file = "phantom"
size = [64, 64, 48]
iso = ISO
crop = false  # which the iso value decides
solid = false
pose = { position_mm = [-12.5, -0.5, 0.0], orientation = [-0.704416, 0.061628, -0.061628, 0.704416] }
[[tool]]
shape = "ball"
radius_mm = 1.0
'''
AWAY = '''start_mm = [4, 9, 1]
[[step]]
hold = 3600
'''
TOKEN = 'a-token-of-the-page-test'


class Rig:
    """Processes of kerf on names of their own; all of them end with it."""

    def __init__(self, bin_folder, work):
        self.bin, self.work = bin_folder, work
        self.name = f'page-{os.getpid()}'
        self.processes = {}
        for file, text in (('scene.toml', SCENE), ('hand.toml', HAND), ('tokens', TOKEN + '\n')):
            self.write(file, text)

    def write(self, name, text):
        with open(self.path(name), 'w', opener=lambda p, f: os.open(p, f, 0o600)) as out:
            out.write(text)

    def path(self, name):
        return os.path.join(self.work, name)

    def start(self, what, *arguments):
        with open(self.path(what + '.log'), 'w') as log:
            self.processes[what] = subprocess.Popen([os.path.join(self.bin, 'kerf-' + what), *arguments],
                                                    stdin=subprocess.DEVNULL, stdout=log, stderr=log)

    def log(self, what):
        with open(self.path(what + '.log')) as log:
            return log.read()

    def end(self, what, how=subprocess.Popen.terminate):
        process = self.processes.pop(what)
        how(process)
        process.wait()

    def start_run(self):
        """Controller and hand; ready to cut at once."""
        socket = self.path('port')
        if os.path.exists(socket):
            os.remove(socket)
        self.start('emulator', '--front', 'socket', '--socket', socket, '--hand', self.path('hand.toml'),
                   '--unit-mm', '1')
        self.start('controller', '--scene', self.path('scene.toml'), '--torque-scale', '0.342,0.342,0.342',
                   '--port', 'socket:' + socket, '--name', self.name)

    def start_bridge(self, listen='127.0.0.1:0', *more):
        """Its address with the token that is good for all browsers, once it listens."""
        self.start('bridge', 'serve', '--listen', listen, '--name', self.name, *more)
        end = time.monotonic() + 20
        while time.monotonic() < end and self.processes['bridge'].poll() is None:
            address = re.search(r'wss?://\S+\n', self.log('bridge'))
            if address:
                return address[0].strip().replace('ws', 'http', 1)
            time.sleep(0.02)
        raise RuntimeError('kerf-bridge: ' + self.log('bridge'))

    def native_picture(self, width, height, *look):
        """What kerf-visualizer shows, as PNG."""
        out = self.path('native')
        subprocess.run([os.path.join(self.bin, 'kerf-visualizer'), '--headless', '--name', self.name, '--frames', '1',
                        '--every-ticks', '1', '--size', f'{width}x{height}', '--out', out, *look],
                       check=True, stdout=subprocess.DEVNULL, timeout=60)
        with open(os.path.join(out, 'frame-0001.png'), 'rb') as picture:
            return picture.read()

    def make_certificate(self):
        """A certificate for 127.0.0.1, signed by itself, and its key: two PEM files."""
        certificate, key = self.path('cert.pem'), self.path('key.pem')
        subprocess.run(['openssl', 'req', '-x509', '-newkey', 'ec', '-pkeyopt', 'group:P-256', '-noenc', '-subj', '/CN=page',
                        '-addext', 'subjectAltName=IP:127.0.0.1', '-keyout', key, '-out', certificate],
                       check=True, stderr=subprocess.DEVNULL)
        return certificate, key

    def close(self):
        for what in list(self.processes):
            self.end(what)
