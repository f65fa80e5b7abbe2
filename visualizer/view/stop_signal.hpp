// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace kerf {

/// Turns SIGINT and SIGTERM into `stop_requested()`, so that files are finished and GL is released.
void catch_stop_signals();

[[nodiscard]] bool stop_requested() noexcept;

}  // namespace kerf
