// SPDX-License-Identifier: Apache-2.0
#include "visualizer/scene/camera_pose.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <sstream>
#include <utility>
#include <vector>

#include "shared/posix/atomic_file.hpp"
#include "shared/text/text.hpp"
#include "visualizer/scene/view_file.hpp"
#include "visualizer/scene/visualizer_error.hpp"

namespace kerf {

namespace {

constexpr double kStepsPerMm = 1e6;  // of a written file; no two places lie nearer

constexpr const char* kNine =
    "give EYE,TARGET,UP, nine numbers (mm), or a file as n in the window writes it";

std::string written(const glm::dvec3& v) {
  return number_text(v.x) + "," + number_text(v.y) + "," + number_text(v.z);
}

/// Of the axis that is farthest from `direction`.
std::string other_axis(const glm::dvec3& direction) {
  const glm::dvec3 part = glm::abs(direction);
  if (part.y <= part.x && part.y <= part.z) return "0,1,0";
  return part.z <= part.x ? "0,0,1" : "1,0,0";
}

}  // namespace

PresentedView presented(const CameraPose& pose) {
  PresentedView view;
  for (int i = 0; i < 3; ++i) {
    view.eye_mm[i] = pose.eye_mm[i];
    view.target_mm[i] = pose.target_mm[i];
    view.up[i] = pose.up[i];
  }
  return view;
}

CameraPose pose_of(const PresentedView& view) {
  const auto vector = [](const double(&v)[3]) { return glm::dvec3(v[0], v[1], v[2]); };
  return {vector(view.eye_mm), vector(view.target_mm), vector(view.up)};
}

std::string problem_with(const CameraPose& pose) {
  const auto far = [](const char* name, const glm::dvec3& place) {
    return std::string(name) + " " + written(place) + " is beyond " + number_text(kFarthestViewMm) +
           " mm; give smaller numbers";
  };
  const std::string up = "UP " + written(pose.up);
  const auto such_as = [&] { return ", such as " + other_axis(pose.target_mm - pose.eye_mm); };
  switch (problem_in(presented(pose))) {
    case ViewProblem::none:
      break;
    case ViewProblem::eye_far:
      return far("EYE", pose.eye_mm);
    case ViewProblem::target_far:
      return far("TARGET", pose.target_mm);
    case ViewProblem::up_far:
      return far("UP", pose.up);
    case ViewProblem::eye_at_target:
      return "EYE and TARGET are both at " + written(pose.eye_mm) + "; move one of them";
    case ViewProblem::up_zero:
      return up + " has no direction; give one" + such_as();
    case ViewProblem::up_along_view:
      return up + " is along the view; give another direction" + such_as();
  }
  return {};
}

CameraPose parse_camera_numbers(std::string_view text) {
  const std::string location = "--camera: ";
  std::vector<double> numbers;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const std::string_view word = text.substr(begin, end - begin);
    const auto number = number_in(word);
    if (!number) {
      throw VisualizerError(location + "'" + one_line(word) + "' is no number; " + kNine);
    }
    numbers.push_back(*number);
    begin = end + 1;
  }
  if (numbers.size() != 9) {
    throw VisualizerError(location + std::to_string(numbers.size()) + " numbers; " + kNine);
  }
  const auto at = [&](std::size_t i) {
    return glm::dvec3(numbers[i], numbers[i + 1], numbers[i + 2]);
  };
  const CameraPose pose{at(0), at(3), at(6)};
  if (const std::string problem = problem_with(pose); !problem.empty()) {
    throw VisualizerError(location + problem);
  }
  return pose;
}

CameraPose parse_camera(std::string_view text, const std::string& name) {
  const TomlNode file = parse_view_file(text, name);
  for (const TomlNode& entry : file.entries) {
    if (entry.key == "camera" && entry.form == TomlNode::Form::table) continue;
    refuse_in(name, entry.key_line, entry.key + " is not known here; known is the table [camera]");
  }
  const TomlNode* table = file.find("camera");
  if (table == nullptr) throw VisualizerError(name + ": there is no table [camera]; write one");
  CameraPose pose;
  const std::array<std::pair<std::string_view, glm::dvec3*>, 3> keys{
      {{"eye_mm", &pose.eye_mm}, {"target_mm", &pose.target_mm}, {"up", &pose.up}}};
  std::array<bool, 3> given{};
  for (const TomlNode& entry : table->entries) {
    std::size_t k = 0;
    while (k < keys.size() && keys[k].first != entry.key) ++k;
    if (k == keys.size()) {
      refuse_in(name, entry.key_line,
                "camera." + entry.key + " is not known here; known are eye_mm, target_mm and up");
    }
    for (std::size_t i = 0; i < 3; ++i) {
      const auto number = entry.form == TomlNode::Form::array && entry.entries.size() == 3
                              ? entry.entries[i].number()
                              : std::nullopt;
      if (!number) {
        refuse_in(
            name, entry.line,
            "camera." + entry.key + " = " + entry.shown + " is not three numbers; give [x, y, z]");
      }
      (*keys[k].second)[static_cast<int>(i)] = *number;
    }
    given[k] = true;
  }
  for (std::size_t k = 0; k < keys.size(); ++k) {
    if (given[k]) continue;
    refuse_in(name, table->key_line,
              "camera has no " + std::string(keys[k].first) + "; give [x, y, z]");
  }
  if (const std::string problem = problem_with(pose); !problem.empty()) {
    refuse_in(name, table->key_line, problem);
  }
  return pose;
}

bool is_camera_file(std::string_view given) {
  return given.find(',') == given.npos || given.ends_with(".toml");
}

CameraPose read_camera(const std::string& given) {
  if (!is_camera_file(given)) return parse_camera_numbers(given);
  return parse_camera(read_view_file(given, "camera",
                                     "name a camera, as n in the window writes it, or give nine "
                                     "numbers, EYE,TARGET,UP"),
                      given);
}

void write_camera(const std::filesystem::path& file, const CameraPose& pose) {
  const auto rounded = [](const glm::dvec3& v) {
    std::string text;
    for (int i = 0; i < 3; ++i) {
      text += (i > 0 ? ", " : "") + number_text(std::round(v[i] * kStepsPerMm) / kStepsPerMm + 0.0);
    }
    return text;
  };
  std::ostringstream text;
  text << "# Where the picture is seen from: kerf-visualizer --camera FILE\n[camera]\n"
       << "eye_mm = [" << rounded(pose.eye_mm) << "]\n"
       << "target_mm = [" << rounded(pose.target_mm) << "]\n"
       << "up = [" << rounded(pose.up) << "]\n";
  write_new_file(file, text.str());
}

}  // namespace kerf
