// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>
#include <unordered_map>

#include <glm/glm.hpp>

#include "visualizer/gl/names.hpp"

namespace kerf {

/// A linked set of shaders. Uniforms are set by name; one that the linker removed is ignored.
class GlProgram {
 public:
  /// Names of files in `shaders/`, the stage by their ending (.vert, .frag); a stage may have
  /// several. `defines` are lines that each file sees below its #version. Throws VisualizerError
  /// with the driver's first line.
  GlProgram(std::initializer_list<std::string_view> files, std::string_view defines = {});

  void use() const { glUseProgram(name_.id()); }
  void set(std::string_view uniform, float value) const;
  void set(std::string_view uniform, int value) const;
  void set(std::string_view uniform, glm::vec2 value) const;
  void set(std::string_view uniform, glm::vec3 value) const;
  void set(std::string_view uniform, glm::vec4 value) const;
  void set(std::string_view uniform, const glm::mat3& value) const;
  void set(std::string_view uniform, const glm::mat4& value) const;

 private:
  [[nodiscard]] GLint location(std::string_view uniform) const;

  GlProgramName name_;
  mutable std::unordered_map<std::string, GLint> locations_;
};

}  // namespace kerf
