"""Files of every kind that a name can lead to, good, damaged and absurd; and who reads them.

Damage is drawn from a generator that the caller seeds. Some of it happens to leave a good file.
"""

from __future__ import annotations
