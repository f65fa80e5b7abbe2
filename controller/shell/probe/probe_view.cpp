// SPDX-License-Identifier: Apache-2.0
#include "controller/shell/probe/probe_view.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdio>

#include "controller/plan/plan_device.hpp"

namespace kerf {

ProbeView::ProbeView(const DeviceSettings& device, int rate_hz) {
  LoadedScene scene;
  scene.device = device;
  scene.servo.rate_hz = rate_hz;
  ServoPlan<DoubleNumbers> plan;
  plan_device(device, plan);
  plan_limits(scene, plan);
  plan_ = plan.device;
  timing_ = plan.timing;
}

void ProbeView::take(const DeviceReport& report, std::int64_t now_ns) noexcept {
  if (follow_encoders(report, plan_.absolute_encoders, timing_, encoders_)) {
    seen_.calibrated = true;
  }
  if (!report.fresh) {
    seen_.ticks += seen_.reports > 0 ? 1 : 0;
    return;
  }
  if (seen_.reports > 0) {
    for (std::size_t i = 0; i < 3; ++i) {
      travelled_[i] += static_cast<std::int16_t>(report.encoder[i] - last_.encoder[i]);
      seen_.lowest[i] = std::min(seen_.lowest[i], travelled_[i]);
      seen_.highest[i] = std::max(seen_.highest[i], travelled_[i]);
    }
    const double gap_ms = static_cast<double>(now_ns - last_ns_) / 1e6;
    seen_.longest_gap_ms = std::max(seen_.longest_gap_ms, gap_ms);
  }
  ++seen_.ticks;
  ++seen_.reports;
  last_ = report;
  last_ns_ = now_ns;
  seen_.pressed[0] = seen_.pressed[0] || report.button1;
  seen_.pressed[1] = seen_.pressed[1] || report.button2;
  seen_.parked = seen_.parked || report.parked;
  seen_.homed = seen_.homed || report.homed;
}

std::array<double, 3> ProbeView::tip_mm() const noexcept {
  const auto tip = device_pose(plan_, encoders_, {}).arm.tip_mm;
  return {tip.x, tip.y, tip.z};
}

std::string ProbeView::line() const {
  char tip[48] = "unknown until parked at rest";
  if (seen_.calibrated) {
    const auto mm = tip_mm();
    std::snprintf(tip, sizeof tip, "%+7.1f %+7.1f %+7.1f mm", mm[0], mm[1], mm[2]);
  }
  char text[128];
  std::snprintf(text, sizeof text, "counts %6d %6d %6d  tip %s  buttons %c%c  %s%s",
                last_.encoder[0], last_.encoder[1], last_.encoder[2], tip,
                last_.button1 ? '1' : '-', last_.button2 ? '2' : '-',
                last_.parked ? "parked" : "in hand", last_.homed ? "" : ", not homed");
  return text;
}

}  // namespace kerf
