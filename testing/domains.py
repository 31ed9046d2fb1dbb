"""ROS domains that no other test process on this machine has."""

from __future__ import annotations

import atexit
import socket

# Above 101 the ports of a domain are among those that Linux gives to anybody; 0 is everybody's
# default, and the demonstration has 87.
_DOMAINS = range(1, 87)


def claim_domain() -> int:
    """Claim the lowest free domain until this process ends.

    The claim is an abstract Unix socket: like a domain's ports it belongs to the network, not to
    a folder or a user, and it goes with its process however that ends.
    """
    for domain in _DOMAINS:
        claim = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        try:
            claim.bind(f"\0focus_planner/tests/domain/{domain}")
        except OSError:
            claim.close()
            continue
        atexit.register(claim.close)
        return domain
    raise RuntimeError(f"expected a free ROS domain among {_DOMAINS}, got none")
