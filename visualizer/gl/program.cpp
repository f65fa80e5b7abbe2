// SPDX-License-Identifier: Apache-2.0
#include "visualizer/gl/program.hpp"

#include <array>

#include <glm/gtc/matrix_inverse.hpp>
#include <glm/gtc/type_ptr.hpp>

#include "visualizer/gl/context.hpp"
#include "visualizer/scene/visualizer_error.hpp"

namespace kerf {

namespace {

std::string first_line(std::string_view text) {
  return std::string(text.substr(0, text.find('\n')));
}

std::string_view shader_text(std::string_view file) {
  for (const ShaderText& shader : shader_texts()) {
    if (shader.file == file) return shader.text;
  }
  throw VisualizerError("shaders/" + std::string(file) + ": not part of this build");
}

void attach_stage(GLuint program, std::string_view file, std::string_view defines) {
  const std::string_view text = shader_text(file);
  const std::size_t below_version = text.find('\n', text.find("#version")) + 1;
  // Nothing in the shaders is newer than 3.30.
  std::string source(has_newest_gl() ? text.substr(0, below_version) : "#version 330 core\n");
  source += defines;
  source += text.substr(below_version);
  const GLuint shader =
      glCreateShader(file.ends_with(".vert") ? GL_VERTEX_SHADER : GL_FRAGMENT_SHADER);
  const char* const begin = source.data();
  const auto length = static_cast<GLint>(source.size());
  glShaderSource(shader, 1, &begin, &length);
  glCompileShader(shader);
  GLint compiled = GL_FALSE;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &compiled);
  std::array<char, 512> log{};
  if (compiled != GL_TRUE) {
    glGetShaderInfoLog(shader, static_cast<GLsizei>(log.size()), nullptr, log.data());
  }
  glAttachShader(program, shader);
  glDeleteShader(shader);  // lives on with the program
  if (compiled != GL_TRUE) {
    throw VisualizerError("shaders/" + std::string(file) + ": " + first_line(log.data()) +
                          "; this OpenGL driver refuses it, try another one");
  }
}

}  // namespace

GlProgram::GlProgram(std::initializer_list<std::string_view> files, std::string_view defines)
    : name_(GlProgramName::create()) {
  std::string all;
  for (const std::string_view file : files) {
    attach_stage(name_.id(), file, defines);
    all += (all.empty() ? "" : " + ") + std::string(file);
  }
  glLinkProgram(name_.id());
  GLint linked = GL_FALSE;
  glGetProgramiv(name_.id(), GL_LINK_STATUS, &linked);
  if (linked == GL_TRUE) return;
  std::array<char, 512> log{};
  glGetProgramInfoLog(name_.id(), static_cast<GLsizei>(log.size()), nullptr, log.data());
  throw VisualizerError("shaders/" + all + ": " + first_line(log.data()) +
                        "; this OpenGL driver refuses it, try another one");
}

GLint GlProgram::location(std::string_view uniform) const {
  const std::string key(uniform);
  const auto known = locations_.find(key);
  if (known != locations_.end()) return known->second;
  return locations_.emplace(key, glGetUniformLocation(name_.id(), key.c_str())).first->second;
}

void GlProgram::set(std::string_view uniform, float value) const {
  glProgramUniform1f(name_.id(), location(uniform), value);
}
void GlProgram::set(std::string_view uniform, int value) const {
  glProgramUniform1i(name_.id(), location(uniform), value);
}
void GlProgram::set(std::string_view uniform, glm::vec2 value) const {
  glProgramUniform2f(name_.id(), location(uniform), value.x, value.y);
}
void GlProgram::set(std::string_view uniform, glm::vec3 value) const {
  glProgramUniform3f(name_.id(), location(uniform), value.x, value.y, value.z);
}
void GlProgram::set(std::string_view uniform, glm::vec4 value) const {
  glProgramUniform4f(name_.id(), location(uniform), value.x, value.y, value.z, value.w);
}
void GlProgram::set(std::string_view uniform, const glm::mat3& value) const {
  glProgramUniformMatrix3fv(name_.id(), location(uniform), 1, GL_FALSE, glm::value_ptr(value));
}
void GlProgram::set(std::string_view uniform, const glm::mat4& value) const {
  glProgramUniformMatrix4fv(name_.id(), location(uniform), 1, GL_FALSE, glm::value_ptr(value));
}

void set_view(const GlProgram& program, const View& view) {
  program.set("u_half_size_at_1mm",
              glm::vec2(view.tan_half_height * view.aspect, view.tan_half_height));
  program.set("u_middle_at_1mm", glm::vec2(view.middle_right, 0.0));
  program.set("u_near_mm", static_cast<float>(view.near_mm));
  program.set("u_far_mm", static_cast<float>(view.far_mm));
  // A plane goes to the eye as a row: dot(clip_plane, world_from_eye * p).
  program.set("u_clip_plane_eye",
              glm::vec4(view.clip_plane * glm::affineInverse(view.eye_from_world)));
  program.set("u_up_eye", glm::vec3(view.eye_from_world * glm::dvec4(0, 1, 0, 0)));
}

}  // namespace kerf
