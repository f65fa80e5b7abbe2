// SPDX-License-Identifier: Apache-2.0
#include "lab/impedance/logged_wall.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "hil/hil_error.hpp"
#include "record/manifest.hpp"
#include "record/scene_facts.hpp"
#include "record/tick_log.hpp"
#include "shared/text/json.hpp"
#include "shared/text/text.hpp"

namespace kerf::impedance {
namespace {

/// A tick of the stretch: place and force along the axes of the device.
struct LoggedTick {
  std::array<double, 3> tip_mm, force_n;
};

/// The settings of scene.json that determine the wall. Returns the scale from device to scene.
double take_scene(const std::filesystem::path& folder, LoggedWall& wall) {
  try {
    const Json scene = Json::parse(recorded_scene(folder));
    const auto word = [&](const char* table, const char* key, const char* otherwise) {
      const Json& entry = scene.at(table);
      if (!entry.contains(key)) return std::string(otherwise);
      const Json& law = entry.at(key);
      if (!law.contains("name")) return law.get<std::string>();
      std::string text = law.at("name").get<std::string>();
      law.visit([&]<class T>(const T& members) {
        if constexpr (std::same_as<T, Json::Members>) {
          for (const Json::Member& member : members) {
            if (member.key == "name") continue;
            text += "/" + member.key + "=" + number_text(member.value.template get<double>());
          }
        }
      });
      return text;
    };
    wall.stiffness_n_per_mm = scene.at("force").at("stiffness_n_per_mm").get<double>();
    wall.damping_ns_per_mm = scene.at("force").at("damping_ns_per_mm").get<double>();
    wall.estimator = word("servo", "velocity", "foaw");
    const std::string model = scene.at("force").at("model").get<std::string>();
    wall.law = model == "proxy" ? word("force", "law", "coupling") : model;
    wall.stabiliser = word("force", "stabiliser", "none");
    wall.rate_hz = scene.at("servo").at("rate_hz").get<double>();
    return scene.at("device").at("workspace_scale").get<double>();
  } catch (const JsonError& error) {
    throw HilError("--log: " + (folder / kSceneName).string() + ": " + error.what() +
                   "; give the recording of a scene with force.stiffness_n_per_mm and a device");
  }
}

/// The longest stretch of the log in which the law alone made the force.
std::vector<LoggedTick> longest_contact(const std::filesystem::path& folder, double scale) {
  std::vector<LoggedTick> longest, now;
  constexpr std::size_t kMostTicks = 2'000'000;  // half an hour at 1 kHz, 100 MB
  std::uint64_t next_tick = 0;
  const Manifest manifest = read_facts(folder);
  TickLogReader log = std::move(open_logs(folder, manifest.arms).front());
  const auto end = [&] {
    if (now.size() > longest.size()) std::swap(now, longest);
    now.clear();
  };
  log.for_each([&](const TickRecord& row) {
    constexpr std::uint32_t kWanted = kFlagContact | kFlagMotorsOn;
    constexpr std::uint32_t kUnwanted = kFlagClamped | kFlagStaleInput | kFlagDeviceFault;
    const bool counts = (row.flags & kWanted) == kWanted && (row.flags & kUnwanted) == 0;
    if (!counts || row.tick != next_tick || now.size() >= kMostTicks) end();
    next_tick = row.tick + 1;
    if (!counts) return;
    LoggedTick& tick = now.emplace_back();
    for (std::size_t i = 0; i < 3; ++i) {
      tick.tip_mm[i] = row.position_mm[i] / scale;
      tick.force_n[i] = double{row.commanded_force_n[i]};
    }
  });
  end();
  return longest;
}

/// The differences from tick to tick, of both alike: their spectra are then flatter, so that a
/// strong slow motion leaks less into a weak fast one, and their ratio is unchanged.
std::vector<double> differences(const std::vector<double>& values) {
  std::vector<double> out;
  for (std::size_t i = 1; i < values.size(); ++i) out.push_back(values[i] - values[i - 1]);
  return out;
}

}  // namespace

LoggedWall read_logged_wall(const std::filesystem::path& folder) try {
  LoggedWall wall;
  const double scale = take_scene(folder, wall);
  const std::vector<LoggedTick> stretch = longest_contact(folder, scale);
  if (static_cast<double>(stretch.size()) < wall.rate_hz) {
    throw HilError("--log: " + folder.string() + ": " + std::to_string(stretch.size()) +
                   " ticks of unbroken contact below the limits of the force, and a second is "
                   "needed; record a hand that shakes within a wall");
  }
  std::array<double, 3> mean_n{};
  for (const LoggedTick& tick : stretch) {
    for (std::size_t i = 0; i < 3; ++i) mean_n[i] += tick.force_n[i];
  }
  const double length = std::hypot(mean_n[0], mean_n[1], mean_n[2]);
  const auto along = [&](const std::array<double, 3>& of) {
    return (of[0] * mean_n[0] + of[1] * mean_n[1] + of[2] * mean_n[2]) / length;
  };
  for (const LoggedTick& tick : stretch) {
    wall.tip_mm.push_back(along(tick.tip_mm));
    wall.force_n.push_back(along(tick.force_n));
  }
  return wall;
} catch (const RecordError& error) {
  throw HilError(std::string("--log: ") + error.what());
}

SineResult logged_at(const LoggedWall& wall, const SampledLoop& loop, double hz) {
  const std::vector<double> moved_mm = differences(wall.tip_mm),
                            change_n = differences(wall.force_n);
  const double w = kTurn * hz * loop.period_s;
  // Eight periods: Hann's window then has its first zero a quarter of the frequency away.
  constexpr double kPeriods = 8, kLeastTicks = 256;
  const auto length =
      static_cast<std::size_t>(std::max(kLeastTicks, std::ceil(kPeriods * kTurn / w)));
  double of_tip = 0, of_force = 0, most = 0;
  Impedance cross = 0;
  std::size_t segments = 0;
  for (std::size_t begin = 0; begin + length <= moved_mm.size(); begin += length / 2, ++segments) {
    Impedance tip = 0, force = 0;
    for (std::size_t i = 0; i < length; ++i) {
      const double at = static_cast<double>(i);
      const double window = 1 - std::cos(kTurn * (at + 0.5) / static_cast<double>(length));
      const Impedance wave = std::polar(window, -w * at);
      tip += moved_mm[begin + i] * wave;
      force += change_n[begin + i] * wave;
    }
    of_tip += std::norm(tip);
    of_force += std::norm(force);
    cross += force * std::conj(tip);
    most = std::max(most, std::abs(tip));
  }
  // The window's mean is 1; a difference is 2 sin(w/2) of the motion.
  SineResult row{hz, 2 * most / static_cast<double>(length) / (2 * std::sin(w / 2)), {}, {}};
  if (segments < 2 || !(of_tip > 0) || !(of_force > 0)) return row;
  const double coherence = std::norm(cross) / (of_tip * of_force);
  const double error = std::sqrt((1 - coherence) / (2 * coherence * static_cast<double>(segments)));
  constexpr double kMostError = 0.02;
  if (!(error <= kMostError)) return row;
  const Impedance jwt(0, w);
  const Impedance hold =
      std::exp(-jwt * (loop.delay_s / loop.period_s)) * (1.0 - std::exp(-jwt)) / jwt;
  row.wall = -cross / of_tip * hold * loop.period_s / jwt;
  return row;
}

}  // namespace kerf::impedance
