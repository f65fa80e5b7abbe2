// SPDX-License-Identifier: Apache-2.0
#include "arm/inverse3/service_answers.hpp"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <string_view>
#include <type_traits>

#include "shared/text/json.hpp"
#include "shared/text/text.hpp"

namespace kerf::inverse3 {
namespace {

constexpr unsigned kOk = 200;
constexpr int kFastestHz = 8000;

/// "3.5.0.0" as 305; nothing for another text.
std::optional<int> number_of(std::string_view text) {
  int parts[2]{};
  for (int& part : parts) {
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), part);
    if (error != std::errc{} || part < 0 || part > 99) return std::nullopt;
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    if (&part == parts && !text.starts_with('.')) return std::nullopt;
    if (!text.empty()) text.remove_prefix(1);
  }
  return parts[0] * 100 + parts[1];
}

/// The number in the answer to a setting, whose envelope is not documented: alone, or as a member
/// of one of these names.
std::optional<double> setting_within(const Json& value) {
  return value.visit([&](const auto& held) -> std::optional<double> {
    using T = std::decay_t<decltype(held)>;
    if constexpr (std::is_same_v<T, double> || std::is_same_v<T, std::int64_t> ||
                  std::is_same_v<T, std::uint64_t>) {
      return static_cast<double>(held);
    } else if constexpr (std::is_same_v<T, Json::Members>) {
      for (const char* name : {"value", "force_scale", "devices/force_scale", "data"}) {
        if (value.contains(name)) return setting_within(value.at(name));
      }
    }
    return std::nullopt;
  });
}

/// The service's own word for an error: {"ok": false, "error": "in use"}.
std::string reason_in(const std::string& body) {
  constexpr std::size_t kMost = 80;
  try {
    const auto error = Json::parse(body).at("error").get<std::string>();
    return ": " + escaped(error.substr(0, kMost));
  } catch (const JsonError&) {
    return "";
  }
}

/// What a status says, and the way out. `answer`: "HTTP 503: in use".
std::string text_of_status(unsigned status, const std::string& answer) {
  switch (status) {
    case 503:
      return "is in use (" + answer +
             "); end the other program that uses the device, or wait until it has ended";
    case 429:
      return "takes no more requests now (" + answer + "); end other programs that use it";
    case 401:
    case 403:
    case 407:
      return "asks for a login (" + answer +
             "), as no Inverse Service does; a proxy or another program answers there: name the "
             "service's own address and port, --service HOST:PORT";
    case 404:
      return "has no such address (" + answer + "); " + kNeeds;
    default:
      break;
  }
  if (status >= 300 && status < 400) {
    return "sends elsewhere (" + answer +
           "), so another program answers there: name the service's own address and port, "
           "--service "
           "HOST:PORT";
  }
  if (status >= 500) {
    return "has an error (" + answer +
           "); systemctl restart haply-inverse-service, and see /var/log/haply-inverse-service";
  }
  return "does not take the request (" + answer + "); " + kNeeds;
}

}  // namespace

void throw_status(const std::string& who, const HttpAnswer& answer) {
  const std::string text = who + " " +
                           text_of_status(answer.status, "HTTP " + std::to_string(answer.status) +
                                                             reason_in(answer.body));
  if (answer.status >= 500 || answer.status == 429) throw std::runtime_error(text);
  throw Refusal(text);
}

ServiceVersion version_in(const HttpAnswer& answer) {
  if (answer.status != kOk) throw_status("the service", answer);
  ServiceVersion version;
  try {
    const Json json = Json::parse(answer.body);
    version.text = one_line(json.at("project_version").get<std::string>());
    if (json.contains("kerf_emulator")) {
      const Json& emulator = json.at("kerf_emulator");
      if (emulator.at("lockstep").get<bool>()) {
        version.lockstep_hz = std::clamp(emulator.at("rate_hz").get<int>(), 1, kFastestHz);
      }
    }
  } catch (const JsonError&) {
    throw Refusal("what answers there gives no version of an Inverse Service (HTTP " +
                  std::to_string(answer.status) + "); " + kNeeds);
  }
  const auto number = number_of(version.text);
  if (!number || *number < 301) throw Refusal("version " + version.text + "; " + kNeeds);
  version.key = *number >= 305 ? ForceKey::vector : ForceKey::values;
  return version;
}

std::optional<double> force_scale_of(const HttpAnswer& answer) {
  if (answer.status != kOk) return std::nullopt;
  try {
    return setting_within(Json::parse(answer.body));
  } catch (const JsonError&) {
    return std::nullopt;
  }
}

}  // namespace kerf::inverse3
