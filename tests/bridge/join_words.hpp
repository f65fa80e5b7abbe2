// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <functional>
#include <ostream>
#include <sstream>
#include <string>
#include <utility>

#include "bridge/join/join.hpp"
#include "bridge/net/address.hpp"

namespace kerf::test {

/// Ends a join as soon as it says something.
struct StopAtWords : std::stringbuf {
  int sync() override {
    stop = true;
    return 0;
  }
  std::atomic<bool> stop{false};
};

/// What a join tells first, or with which it ends.
inline std::string first_words(const bridge::JoinOptions& options) {
  StopAtWords words;
  std::ostream said(&words);
  try {
    bridge::run_join(options, words.stop, said);
  } catch (const bridge::BridgeError& error) {
    return error.what();
  }
  const std::string line = words.str().substr(std::string("kerf-bridge: ").size());
  return line.substr(0, line.find('\n'));
}

/// Calls `act` with all that a join has said, whenever it says something.
struct OnWords : std::stringbuf {
  explicit OnWords(std::function<void(const std::string&)> its) : act(std::move(its)) {}
  int sync() override {
    act(str());
    return 0;
  }
  std::function<void(const std::string&)> act;
};

/// With what a join ends by itself.
inline std::string last_words(const bridge::JoinOptions& options) {
  const std::atomic<bool> stop{false};
  std::ostringstream said;
  try {
    bridge::run_join(options, stop, said);
  } catch (const bridge::BridgeError& error) {
    return error.what();
  }
  return "no end";
}

}  // namespace kerf::test
