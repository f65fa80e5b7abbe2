# SPDX-License-Identifier: Apache-2.0
"""Logs of kerf, and the shared segment of a running kerf-controller, as NumPy arrays. docs/compatibility.md shows both."""
from .log import Log
from .segment import Segment, SegmentError

__all__ = ["Log", "Segment", "SegmentError"]
