// SPDX-License-Identifier: Apache-2.0
#include "controller/shell/explain_scene.hpp"

#include <cstdio>
#include <stdexcept>
#include <string>

#include "controller/load/scene_json.hpp"
#include "controller/plan/cost/explain.hpp"
#include "controller/plan/cost/work_budget.hpp"
#include "controller/shell/scene_segment.hpp"
#include "shared/posix/cores.hpp"
#include "shared/posix/new_file.hpp"

namespace kerf {

void explain_scene(const ControllerOptions& options, LoadedScene& scene, CompiledScene& servo) {
  if (!options.report.empty()) check_new_file(options.report);
  const int core = options.real_time.cpu >= 0 ? options.real_time.cpu : allowed_cores().back();
  static_cast<void>(pin_to_core(core));  // where it may not, times are less even
  const SegmentPlan segment = plan_segment(segment_spec(scene, canonical_json(scene), 0));
  check_memory(scene, servo.costs(), 0);
  servo.take(scene);
  const Explanation explanation = explain(scene, servo, segment);
  std::fputs(explanation_text(explanation).c_str(), stdout);
  if (!options.report.empty()) write_new_file(options.report, explanation_json(explanation));
  const std::string refusal = over_budget(scene, servo.costs());
  if (!refusal.empty()) throw std::runtime_error(refusal);
}

}  // namespace kerf
