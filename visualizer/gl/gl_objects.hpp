// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>

#include <epoxy/gl.h>

namespace kerf {

/// Owns one GL object. Make and destroy it while its context is current; 0 means none.
template <void (*Create)(GLuint*), void (*Destroy)(const GLuint*)>
class GlName {
 public:
  GlName() = default;
  [[nodiscard]] static GlName create() {
    GlName name;
    Create(&name.id_);
    return name;
  }
  GlName(GlName&& other) noexcept : id_(std::exchange(other.id_, 0)) {}
  GlName& operator=(GlName&& other) noexcept {
    std::swap(id_, other.id_);
    return *this;
  }
  GlName(const GlName&) = delete;
  GlName& operator=(const GlName&) = delete;
  ~GlName() {
    if (id_ != 0) Destroy(&id_);
  }

  [[nodiscard]] GLuint id() const noexcept { return id_; }

 private:
  GLuint id_ = 0;
};

// The GL loader's functions are pointers filled at run time, so they are named through these.
namespace gl_calls {
template <auto& Create>
void create(GLuint* id) {
  Create(1, id);
}
template <auto& Destroy>
void destroy(const GLuint* id) {
  Destroy(1, id);
}
template <GLenum Target>
void create_texture(GLuint* id) {
  glCreateTextures(Target, 1, id);
}
inline void create_program(GLuint* id) {
  *id = glCreateProgram();
}
inline void destroy_program(const GLuint* id) {
  glDeleteProgram(*id);
}
}  // namespace gl_calls

/// Texels are read as they are, without a blend of neighbours.
inline void read_nearest(GLuint texture) {
  glTextureParameteri(texture, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTextureParameteri(texture, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
}

template <GLenum Target>
using GlTexture = GlName<gl_calls::create_texture<Target>, gl_calls::destroy<glDeleteTextures>>;
using GlTexture2D = GlTexture<GL_TEXTURE_2D>;
using GlTexture2DArray = GlTexture<GL_TEXTURE_2D_ARRAY>;
using GlTexture3D = GlTexture<GL_TEXTURE_3D>;
using GlBuffer = GlName<gl_calls::create<glCreateBuffers>, gl_calls::destroy<glDeleteBuffers>>;
using GlVertexArray =
    GlName<gl_calls::create<glCreateVertexArrays>, gl_calls::destroy<glDeleteVertexArrays>>;
using GlFramebuffer =
    GlName<gl_calls::create<glCreateFramebuffers>, gl_calls::destroy<glDeleteFramebuffers>>;
using GlProgramName = GlName<gl_calls::create_program, gl_calls::destroy_program>;

}  // namespace kerf
