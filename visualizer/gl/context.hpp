// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

namespace kerf {

/// How a context was made: without a screen by EGL, or by a window.
enum class ContextKind : std::uint8_t { egl_surfaceless, egl_device, window };

[[nodiscard]] const char* to_string(ContextKind kind) noexcept;

/// The driver's own description; reads the current context.
struct GlDriver {
  std::string renderer;  ///< GL_RENDERER
  std::string version;   ///< GL_VERSION
  bool software = false;
  int max_texture_size_3d = 0;
};
[[nodiscard]] GlDriver query_gl_driver();
/// Whether a GL_RENDERER draws on the processor.
[[nodiscard]] bool is_software_gl(std::string_view renderer);

/// A version of OpenGL.
struct GlVersion {
  int major = 0, minor = 0;
};
/// What contexts are asked for, one after the other: 4.5, which has all that is used, and the
/// oldest that may have it by extensions.
inline constexpr std::array kAskedVersions{GlVersion{4, 5}, GlVersion{3, 3}};

/// Whether the current context is 4.5 or newer.
[[nodiscard]] bool has_newest_gl();
/// The extensions that the current context lacks of those that every picture needs, with commas;
/// empty: none, or it is 4.5 or newer.
[[nodiscard]] std::string missing_extensions();

/// The current context's version and driver, for a message; `missing`: missing_extensions().
[[nodiscard]] std::string found_gl(const std::string& missing);
/// Message where nothing but `found` is to be had; it begins with `location`.
[[nodiscard]] std::string gl_is_too_old(const std::string& location, const std::string& found);

/// A core context of OpenGL 4.5, or of 3.3 with the extensions that every picture needs, current on
/// the thread that made it until it goes. One at a time.
class GlContext {
 public:
  GlContext() = default;
  GlContext(const GlContext&) = delete;
  GlContext& operator=(const GlContext&) = delete;
  virtual ~GlContext() = default;
  [[nodiscard]] virtual ContextKind kind() const noexcept = 0;

 protected:
  /// Derived classes call this once the context is current.
  static void watch_for_faults();
};

/// A context that needs no screen.
///
/// EGL surfaceless comes first; if that is a software GL, an EGL device that is hardware is
/// preferred; any EGL device is next; a hidden window, if there is a screen after all, is the
/// last resort. Throws VisualizerError when none works.
[[nodiscard]] std::unique_ptr<GlContext> make_headless_context();

/// Throws VisualizerError if the driver has lost the current context, say because it had to
/// reset the GPU: nothing that the context holds can be drawn any more.
void throw_if_context_is_lost();

/// Called with GL debug messages about errors, undefined behaviour or high severity, synchronously
/// on the calling thread.
using GlFaultHandler = void (*)(const std::string& text);
/// From now on, new contexts are debug contexts that report to `handler`, or ordinary contexts if
/// `handler` is null. For tests: it slows every call.
void report_gl_faults(GlFaultHandler handler) noexcept;
[[nodiscard]] bool gl_faults_are_reported() noexcept;

}  // namespace kerf
