// SPDX-License-Identifier: Apache-2.0
// What a service or another program at its port may send to the Inverse3's driver: messages, one
// after another, each up to a byte 0x1E; and events. Whatever they are, a session goes on within
// its rules.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <stdexcept>
#include <string_view>

#include "arm/inverse3/session.hpp"
#include "shared/wire/cartesian.hpp"

namespace {

using namespace kerf::inverse3;

void require(bool holds) {
  if (!holds) std::abort();
}

std::optional<Session> begin(const ServiceState& first) {
  try {
    return Session({}, ForceKey::vector, first, 0);
  } catch (const std::runtime_error& error) {
    const std::string_view line = error.what();
    require(!line.empty() && line.size() < 1000 && line.find('\n') == line.npos);
    return std::nullopt;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::string_view rest;
  if (size > 0) rest = {reinterpret_cast<const char*>(data), size};
  std::optional<Session> session;
  std::int64_t now_ns = 0;
  std::uint32_t number = 0;
  kerf::CartesianCommand push;
  push.force_on = true;
  push.force_mn = {32767, -32767, 32767};
  ServiceState state;
  while (!rest.empty()) {
    const std::string_view text = rest.substr(0, rest.find('\x1E'));
    rest.remove_prefix(text.size() < rest.size() ? text.size() + 1 : rest.size());
    ServiceEvent event;
    static_cast<void>(parse_event(text, event));
    if (!parse_state(text, state)) continue;
    if (!session) {
      session = begin(state);
      continue;
    }
    now_ns += 6'000'000;  // few messages reach all times of the rules
    const bool may_push = session->bar() == Bar::none;
    const auto force_n = session->force_n(push, now_ns, now_ns);
    MessageBuffer buffer;
    const auto message =
        force_message(session->device_id(), session->key(), force_n, Extra::profile, buffer);
    require(message.ends_with("}}}}]}"));
    double square = 0;
    for (const double axis : force_n) square += axis * axis;
    require(may_push ? square < 100.01 : square == 0);
    if (const auto report = session->take(state, ++number, now_ns)) {
      require(kerf::decode_cartesian_report(encode(*report)) == report);
      require(!report->homed || session->is_proven());
    }
  }
  return 0;
}
