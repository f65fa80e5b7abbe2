// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <thread>

#include "controller/shell/real_time.hpp"
#include "controller/shell/watchdog.hpp"

namespace kerf {

/// Starts the thread that looks every 5 ms, until the jthread is gone: above the servo, so that the
/// servo itself cannot keep it from looking, and on any core but the servo's, so that what takes
/// that core away does not take the watchdog too. With one core, or without the rights, as well as
/// it can.
[[nodiscard]] std::jthread start_watchdog(Watchdog& watchdog, const RealTimeOptions& servo);

}  // namespace kerf
