// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string>

namespace kerf {

enum class ContextKind : std::uint8_t { egl_surfaceless, egl_device, window };

[[nodiscard]] const char* to_string(ContextKind kind) noexcept;

/// What the driver says of itself; asks the current context.
struct GlDriver {
  std::string renderer;  ///< GL_RENDERER
  std::string version;   ///< GL_VERSION
  bool software = false;
  int max_texture_size_3d = 0;
};
[[nodiscard]] GlDriver query_gl_driver();

/// An OpenGL 4.5 core context, current on the thread that made it until it goes. One at a time.
class GlContext {
 public:
  GlContext() = default;
  GlContext(const GlContext&) = delete;
  GlContext& operator=(const GlContext&) = delete;
  virtual ~GlContext() = default;
  [[nodiscard]] virtual ContextKind kind() const noexcept = 0;
};

/// A context that needs no screen.
///
/// EGL surfaceless comes first; where that is a software GL, an EGL device that is hardware is
/// preferred; any EGL device is next; a hidden window, where there is a screen after all, is the
/// last resort. Throws VisualizerError when none works.
[[nodiscard]] std::unique_ptr<GlContext> make_headless_context();

/// Has GL report its errors from now on in the current context; the first one since the last call
/// is thrown by `throw_on_gl_error` as VisualizerError. For tests: it slows every call.
void enable_gl_debug();
void throw_on_gl_error();

}  // namespace kerf
