# SPDX-License-Identifier: Apache-2.0
"""What a machine may lack that a test needs. A reason is printed behind "skipped: ", where .ci/tests.sh finds it."""
import socket
import sys

NETWORK = "no network: 127.0.0.1 cannot be reached"


def has_network():
    """False in a network namespace whose only device, lo, is down."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("127.0.0.1", 9))  # nothing is sent
        except OSError:
            return False
    return True


def need_network():
    """Ends the test as skipped if there is none."""
    if not has_network():
        print("skipped: " + NETWORK)
        sys.exit(77)
