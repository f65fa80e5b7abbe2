// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace kerf {

/// kerf-record: `info DIR`, `plot DIR --out FILE.svg`, `export DIR --csv FILE`. Returns the exit
/// code; bad input throws.
[[nodiscard]] int run_record(int argc, char** argv);

}  // namespace kerf
