// SPDX-License-Identifier: Apache-2.0
// What is noticed of a context that goes wrong.
#include "visualizer/gl/context.hpp"

#include <string>

#include <doctest/doctest.h>
#include <epoxy/gl.h>

#include "tests/visualizer/gl/gl_faults.hpp"
#include "tests/visualizer/gl/gl_fixture.hpp"
#include "visualizer/scene/visualizer_error.hpp"

namespace kerf::context_test {

using namespace kerf::test;

TEST_CASE("a GL error fails the test that makes it" * doctest::should_fail()) {
  if (!have_gl()) FAIL("no OpenGL: nothing to see, and this test has to fail");
  glEnable(GL_INVALID_ENUM);
}

TEST_CASE("errors, undefined behaviour and what is severe are faults, and nothing else is") {
  if (!have_gl()) return;
  static std::string faults;
  faults.clear();
  report_gl_faults([](const std::string& text) { faults += text + " "; });
  const auto say = [](GLenum type, GLenum severity, const char* text) {
    glDebugMessageInsert(GL_DEBUG_SOURCE_APPLICATION, type, 1, severity, -1, text);
  };
  say(GL_DEBUG_TYPE_ERROR, GL_DEBUG_SEVERITY_LOW, "error");
  say(GL_DEBUG_TYPE_UNDEFINED_BEHAVIOR, GL_DEBUG_SEVERITY_MEDIUM, "undefined");
  say(GL_DEBUG_TYPE_PERFORMANCE, GL_DEBUG_SEVERITY_HIGH, "severe");
  say(GL_DEBUG_TYPE_PERFORMANCE, GL_DEBUG_SEVERITY_MEDIUM, "slow");
  say(GL_DEBUG_TYPE_OTHER, GL_DEBUG_SEVERITY_NOTIFICATION, "by the way");
  report_gl_faults(fail_for_gl_fault);
  CHECK(faults == "error undefined severe ");
}

TEST_CASE("a lost context is told in one line with its reason and the way out") {
  if (!have_gl()) return;
  CHECK_NOTHROW(throw_if_context_is_lost());
  // No test can reset a graphics card: the driver's answer is put in its place.
  const auto driver = glGetGraphicsResetStatus;
  glGetGraphicsResetStatus = []() -> GLenum { return GL_GUILTY_CONTEXT_RESET; };
  CHECK_THROWS_WITH_AS(throw_if_context_is_lost(),
                       "OpenGL: the graphics card was reset by this program and its memory is "
                       "lost; start kerf-visualizer again",
                       VisualizerError);
  glGetGraphicsResetStatus = driver;
}

TEST_CASE("a GL that draws on the processor is known by its name") {
  for (const char* name : {"llvmpipe (LLVM 15.0.6, 256 bits)", "softpipe", "Google SwiftShader",
                           "ANGLE (Google, Vulkan 1.3.0 (SwiftShader Device (LLVM 10.0.0)))"}) {
    CHECK(is_software_gl(name));
  }
  for (const char* name : {"NVIDIA H100 PCIe/PCIe/SSE2", "Mesa Intel(R) UHD Graphics 620", ""}) {
    CHECK_FALSE(is_software_gl(name));
  }
}

TEST_CASE("a software context says that it would tell of its loss") {
  if (!have_gl()) return;
  if (!query_gl_driver().software) return;  // other drivers may or may not
  GLint strategy = GL_NO_RESET_NOTIFICATION;
  glGetIntegerv(GL_RESET_NOTIFICATION_STRATEGY, &strategy);
  CHECK(strategy == GL_LOSE_CONTEXT_ON_RESET);
}

}  // namespace kerf::context_test
