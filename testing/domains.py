# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

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
