// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <memory>
#include <string>

#include "controller/device/port/packet_port.hpp"
#include "controller/load/loaded_scene.hpp"
#include "controller/plan/compile.hpp"
#include "controller/plan/cost/gain_margin.hpp"
#include "controller/plan/scene_costs.hpp"
#include "controller/shell/controller_options.hpp"
#include "controller/shell/run_report.hpp"
#include "shared/segment/hand_over.hpp"
#include "shared/segment/writer.hpp"

namespace kerf {

/// A scene with its files, and the servo that is planned for it.
struct PlannedScene {
  LoadedScene scene;
  std::unique_ptr<CompiledScene> servo;
};

/// Loads and plans the scene of the options; warns of own laws that fail their trial. Throws
/// SceneError, also where a signal asks for the end meanwhile.
[[nodiscard]] PlannedScene load_and_plan(const ControllerOptions& options);

/// Refuses a command line that could not be obeyed, also what would be met at the end only.
void check_options(const ControllerOptions& options, const LoadedScene& scene);

/// Refuses work above a tick's budget. In lock-step the device waits: there is no deadline.
void check_budget(const ControllerOptions& options, const LoadedScene& scene,
                  const SceneCosts& costs);

/// Refuses gains that are not run (`refused_gains`).
void check_gains(const ControllerOptions& options, const LoadedScene& scene,
                 const GainMargin& margin);

/// All that a run needs before the device's first packet, made in this order: the scene loaded,
/// planned and checked, the segment that readers find, the port that is open.
///
/// Whatever can be known to go wrong does so here, before the hand is moved. Throws std::exception
/// with one line, also where `stop` became true meanwhile. Then `report` has what was known by then
/// of the scene, and its `waiting` says what was under way.
struct RunStart {
  RunStart(const ControllerOptions& options, const std::atomic<bool>& stop, RunReport& report);

  PlannedScene planned;
  SegmentWriter segment;
  SegmentServer server;
  std::string port_text;  ///< as `--port` names it, `auto` resolved
  std::unique_ptr<PacketPort> port;
};

}  // namespace kerf
