// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>

#include "controller/shell/log_line.hpp"

namespace kerf {

/// Notes once what a program waits for, where it lives longer than a second. Not for a thread of
/// the servo: it starts one of its own.
class LateNote {
 public:
  static constexpr std::chrono::seconds kPatience{1};

  explicit LateNote(std::string note)
      : thread_([text = std::move(note)](const std::stop_token& over) {
          std::mutex mutex;
          std::unique_lock lock(mutex);
          std::condition_variable_any wake;
          wake.wait_for(lock, over, kPatience, [] { return false; });
          if (!over.stop_requested()) log_note(text);
        }) {}

 private:
  std::jthread thread_;
};

}  // namespace kerf
