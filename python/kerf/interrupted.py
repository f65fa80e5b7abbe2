# SPDX-License-Identifier: Apache-2.0


class Interrupted(KeyboardInterrupt):
    """Ctrl-C in a long run. kept: what there is: rows of Loop.run, the Map of zwidth with the columns that are done."""

    def __init__(self, kept):
        super().__init__("interrupted; what there is: .kept")
        self.kept = kept
