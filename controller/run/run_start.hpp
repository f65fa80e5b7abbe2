// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "controller/device/port/packet_port.hpp"
#include "controller/load/loaded_scene.hpp"
#include "controller/load/scene_json.hpp"
#include "controller/plan/compile.hpp"
#include "controller/plan/gain_margin.hpp"
#include "controller/run/controller_options.hpp"
#include "controller/run/run_report.hpp"
#include "shared/external/external_page.hpp"
#include "shared/segment/segment.hpp"
#include "shared/segment/server.hpp"
#include "shared/segment/writer.hpp"

// The start of a run: scene, plan, segment and port, each checked.

namespace kerf {

/// Checks that the memory of a run beyond the loaded scene is available: else locking it would end
/// the program without a message. Throws std::runtime_error with one line.
void check_memory(const LoadedScene& scene, const SceneCosts& costs, std::uint64_t segment_bytes);

/// A scene with its files, what it was loaded from, and the planned servo.
struct PlannedScene {
  SceneSource source;
  LoadedScene scene;
  std::unique_ptr<CompiledScene> servo;
};

/// Loads and plans the scene of the options; warns of own laws that fail their trial. Throws
/// LoadError, also if a signal requests the end meanwhile.
[[nodiscard]] PlannedScene load_and_plan(const ControllerOptions& options);

/// Refuses impossible options, also those that are used only at the end of a run.
void check_options(const ControllerOptions& options, const LoadedScene& scene);

/// Refuses work above a tick's budget. In lock-step the device waits: there is no deadline.
void check_budget(const ControllerOptions& options, const LoadedScene& scene,
                  const SceneCosts& costs);

/// Refuses gains that may not run (`refused_gains`).
void check_gains(const ControllerOptions& options, const LoadedScene& scene,
                 const GainMargin& margin);

/// The state of a run before the device's first packet, made in this order: the scene loaded,
/// planned and checked, the segment for readers, the open ports.
///
/// All checks that can fail are here, before the device moves. Throws std::exception with one line,
/// also if `stop` became true meanwhile. Then `report` has the facts of the scene so far, and its
/// `waiting` names the step.
struct RunStart {
  RunStart(const ControllerOptions& options, const std::atomic<bool>& stop, RunReport& report);

  PlannedScene planned;
  SegmentWriter segment;
  SegmentServer server;
  std::unique_ptr<ExternalPage> external;  ///< in a scene whose force a program gives
  // By arm:
  std::vector<std::string> port_texts;  ///< those of `--port`, with `auto` resolved
  std::vector<std::unique_ptr<PacketPort>> ports;
};

}  // namespace kerf
