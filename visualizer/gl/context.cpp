// SPDX-License-Identifier: Apache-2.0
#include "visualizer/gl/context.hpp"

#include <algorithm>
#include <array>
#include <string_view>
#include <vector>

#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include "visualizer/gl/window.hpp"
#include "visualizer/scene/visualizer_error.hpp"

namespace kerf {

const char* to_string(ContextKind kind) noexcept {
  switch (kind) {
    case ContextKind::egl_surfaceless:
      return "EGL surfaceless";
    case ContextKind::egl_device:
      return "EGL device";
    case ContextKind::window:
      return "window";
  }
  return "?";
}

bool is_software_gl(std::string_view renderer) {
  constexpr auto kKnown = std::to_array<std::string_view>(
      {"llvmpipe", "softpipe", "swrast", "SWR", "SwiftShader", "Software Rasterizer",
       "Apple Software Renderer", "Microsoft Basic Render", "GDI Generic"});
  return std::any_of(kKnown.begin(), kKnown.end(), [&](std::string_view known) {
    return renderer.find(known) != std::string_view::npos;
  });
}

GlDriver query_gl_driver() {
  const auto text = [](GLenum name) {
    const GLubyte* const found = glGetString(name);
    return std::string(found != nullptr ? reinterpret_cast<const char*>(found) : "");
  };
  GlDriver driver{.renderer = text(GL_RENDERER), .version = text(GL_VERSION)};
  driver.software = is_software_gl(driver.renderer);
  glGetIntegerv(GL_MAX_3D_TEXTURE_SIZE, &driver.max_texture_size_3d);
  return driver;
}

bool has_newest_gl() {
  constexpr int kNewest = 45;
  return epoxy_gl_version() >= kNewest;
}

std::string missing_extensions() {
  if (has_newest_gl()) return {};
  // Of objects without binding them, their storage, copies between them, and uniforms.
  constexpr std::array kNeeded{"GL_ARB_direct_state_access", "GL_ARB_texture_storage",
                               "GL_ARB_copy_image", "GL_ARB_separate_shader_objects",
                               "GL_ARB_vertex_attrib_binding"};
  std::string missing;
  for (const char* name : kNeeded) {
    if (!epoxy_has_gl_extension(name)) missing += (missing.empty() ? "" : ", ") + std::string(name);
  }
  return missing;
}

std::string found_gl(const std::string& missing) {
  const GlDriver driver = query_gl_driver();
  return driver.version + " (" + driver.renderer + ")" +
         (missing.empty() ? "" : " without " + missing);
}

std::string gl_is_too_old(const std::string& location, const std::string& found) {
  return location + ": the driver has OpenGL " + found +
         ", and 4.5 is needed, or 3.3 with the extensions of docs/window.md; a browser needs "
         "neither: ./kerf demo --serve";
}

namespace {

/// A context on a display of EGL, without a surface.
class EglContext final : public GlContext {
 public:
  /// Null if the platform gives no context that can draw; `found` is what the first of them had.
  static std::unique_ptr<EglContext> make(EGLenum platform, void* native, ContextKind kind,
                                          std::string& found);
  ~EglContext() override;

  [[nodiscard]] ContextKind kind() const noexcept override { return kind_; }
  void make_current() const { eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_); }

 private:
  EglContext(EGLDisplay display, ContextKind kind) : display_(display), kind_(kind) {}
  bool create(std::string& found);
  [[nodiscard]] EGLContext create(EGLConfig config, GlVersion version, bool tells_of_loss) const;

  EGLDisplay display_;
  EGLContext context_ = EGL_NO_CONTEXT;
  ContextKind kind_;
};

bool has_extension(const char* list, std::string_view name) {
  return list != nullptr && std::string_view(list).find(name) != std::string_view::npos;
}

std::unique_ptr<EglContext> EglContext::make(EGLenum platform, void* native, ContextKind kind,
                                             std::string& found) {
  const EGLDisplay display = eglGetPlatformDisplayEXT(platform, native, nullptr);
  if (display == EGL_NO_DISPLAY) return nullptr;
  std::unique_ptr<EglContext> made(new EglContext(display, kind));
  return made->create(found) ? std::move(made) : nullptr;
}

EglContext::~EglContext() {
  if (context_ == EGL_NO_CONTEXT) return;
  eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  eglDestroyContext(display_, context_);
  // The display stays: the whole process shares it, and the next context takes it again.
}

EGLContext EglContext::create(EGLConfig config, GlVersion version, bool tells_of_loss) const {
  std::vector<EGLint> attributes{
      EGL_CONTEXT_MAJOR_VERSION,       version.major,
      EGL_CONTEXT_MINOR_VERSION,       version.minor,
      EGL_CONTEXT_OPENGL_PROFILE_MASK, EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT};
  if (tells_of_loss) {
    attributes.insert(attributes.end(),
                      {EGL_CONTEXT_OPENGL_RESET_NOTIFICATION_STRATEGY, EGL_LOSE_CONTEXT_ON_RESET});
  }
  if (gl_faults_are_reported()) {
    attributes.insert(attributes.end(), {EGL_CONTEXT_OPENGL_DEBUG, EGL_TRUE});
  }
  attributes.push_back(EGL_NONE);
  return eglCreateContext(display_, config, EGL_NO_CONTEXT, attributes.data());
}

bool EglContext::create(std::string& found) {
  EGLint major = 0;
  EGLint minor = 0;
  if (eglInitialize(display_, &major, &minor) != EGL_TRUE) return false;
  const char* const extensions = eglQueryString(display_, EGL_EXTENSIONS);
  if (!has_extension(extensions, "EGL_KHR_surfaceless_context")) return false;
  if (eglBindAPI(EGL_OPENGL_API) != EGL_TRUE) return false;
  // Any surface type: nothing is ever drawn to one. The default asks for windows.
  constexpr std::array<EGLint, 5> kConfig{EGL_SURFACE_TYPE, 0, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT,
                                          EGL_NONE};
  EGLConfig config = nullptr;
  EGLint configs = 0;
  if (eglChooseConfig(display_, kConfig.data(), &config, 1, &configs) != EGL_TRUE || configs == 0) {
    return false;
  }
  for (const GlVersion version : kAskedVersions) {
    // Not every driver can report that it lost a context.
    for (const bool tells_of_loss : {true, false}) {
      if (context_ == EGL_NO_CONTEXT) context_ = create(config, version, tells_of_loss);
    }
  }
  const bool draws = context_ != EGL_NO_CONTEXT;
  if (!draws) context_ = eglCreateContext(display_, config, EGL_NO_CONTEXT, nullptr);
  if (context_ == EGL_NO_CONTEXT) return false;
  make_current();
  if (eglGetCurrentContext() != context_) return false;
  const std::string missing = draws ? missing_extensions() : "";
  if (!draws || !missing.empty()) {
    if (found.empty()) found = found_gl(missing);
    return false;
  }
  watch_for_faults();
  return true;
}

bool is_software_device(EGLDeviceEXT device) {
  return has_extension(eglQueryDeviceStringEXT(device, EGL_EXTENSIONS), "EGL_MESA_device_software");
}

GlFaultHandler g_fault_handler = nullptr;

void GLAPIENTRY on_gl_message(GLenum, GLenum type, GLuint, GLenum severity, GLsizei length,
                              const GLchar* text, const void*) {
  const bool fault = type == GL_DEBUG_TYPE_ERROR || type == GL_DEBUG_TYPE_UNDEFINED_BEHAVIOR ||
                     severity == GL_DEBUG_SEVERITY_HIGH;
  if (fault && g_fault_handler != nullptr) {
    g_fault_handler(std::string(text, static_cast<std::size_t>(length)));
  }
}

/// The best of what EGL offers, current; null if it offers nothing.
std::unique_ptr<EglContext> best_egl_context(std::string& found) {
  const char* const client = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  std::unique_ptr<EglContext> best;
  if (has_extension(client, "EGL_MESA_platform_surfaceless")) {
    best = EglContext::make(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY,
                            ContextKind::egl_surfaceless, found);
    if (best != nullptr && !query_gl_driver().software) return best;
  }
  if (!has_extension(client, "EGL_EXT_platform_device")) return best;
  constexpr EGLint kMaxDevices = 16;
  std::array<EGLDeviceEXT, kMaxDevices> devices{};
  EGLint count = 0;
  if (eglQueryDevicesEXT(kMaxDevices, devices.data(), &count) != EGL_TRUE) return best;
  for (EGLint i = 0; i < count; ++i) {
    const EGLDeviceEXT device = devices[static_cast<std::size_t>(i)];
    if (best != nullptr && is_software_device(device)) continue;  // no better than what is there
    // NOLINTNEXTLINE(clang-analyzer-cplusplus.NewDeleteLeaks): `best` owns it, or it goes below
    auto other = EglContext::make(EGL_PLATFORM_DEVICE_EXT, device, ContextKind::egl_device, found);
    if (other == nullptr) continue;
    const bool software = query_gl_driver().software;
    if (best == nullptr || !software) best = std::move(other);
    if (!software) break;
  }
  if (best != nullptr) best->make_current();
  return best;
}

}  // namespace

std::unique_ptr<GlContext> make_headless_context() {
  std::string found;
  if (auto egl = best_egl_context(found)) return egl;
  if (Window::has_screen()) {
    return std::make_unique<Window>(WindowPlace{.size = PictureSize{1, 1}},
                                    Window::Visibility::hidden);
  }
  if (!found.empty()) throw VisualizerError(gl_is_too_old("OpenGL", found));
  throw VisualizerError(
      "OpenGL: no context on EGL surfaceless or EGL device, and no screen; install a driver "
      "(Debian: libegl1 libgl1-mesa-dri)");
}

void throw_if_context_is_lost() {
  static const bool kTells = has_newest_gl() || epoxy_has_gl_extension("GL_KHR_robustness");
  if (!kTells) return;
  const GLenum status = glGetGraphicsResetStatus();
  if (status == GL_NO_ERROR) return;
  const char* const whose = status == GL_GUILTY_CONTEXT_RESET     ? "by this program"
                            : status == GL_INNOCENT_CONTEXT_RESET ? "by another program"
                                                                  : "for an unknown reason";
  throw VisualizerError(std::string("OpenGL: the graphics card was reset ") + whose +
                        " and its memory is lost; start kerf-visualizer again");
}

void GlContext::watch_for_faults() {
  if (!gl_faults_are_reported()) return;
  glEnable(GL_DEBUG_OUTPUT);
  glEnable(GL_DEBUG_OUTPUT_SYNCHRONOUS);
  glDebugMessageControl(GL_DONT_CARE, GL_DONT_CARE, GL_DONT_CARE, 0, nullptr, GL_TRUE);
  glDebugMessageCallback(on_gl_message, nullptr);
}

void report_gl_faults(GlFaultHandler handler) noexcept {
  g_fault_handler = handler;
}

bool gl_faults_are_reported() noexcept {
  return g_fault_handler != nullptr;
}

}  // namespace kerf
