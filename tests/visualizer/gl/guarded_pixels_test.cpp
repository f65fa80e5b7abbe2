// SPDX-License-Identifier: Apache-2.0
// A driver writes pixels into memory of ours, and no sanitizer is compiled into it: here that
// memory ends, or begins, where nothing may be written.
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include <doctest/doctest.h>
#include <sys/mman.h>
#include <unistd.h>

#include "tests/visualizer/gl/gl_fixture.hpp"
#include "visualizer/gl/gl_objects.hpp"
#include "visualizer/gl/target.hpp"

namespace kerf::guarded_pixels_test {

using namespace kerf::test;

namespace {

/// Bytes between two pages that nobody may touch, at the end of what lies between them, or at its
/// begin; the rest is filled with a pattern.
class GuardedBytes {
 public:
  enum class At : std::uint8_t { begin, end };

  GuardedBytes(std::size_t size, At at) : size_(size) {
    const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
    inner_ = (size + page - 1) / page * page;
    whole_ = inner_ + 2 * page;
    void* const mapped =
        mmap(nullptr, whole_, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    REQUIRE(mapped != MAP_FAILED);
    first_ = static_cast<std::byte*>(mapped);
    page_ = first_ + page;
    REQUIRE(mprotect(page_, inner_, PROT_READ | PROT_WRITE) == 0);
    std::memset(page_, kPattern, inner_);
    offset_ = at == At::end ? inner_ - size : 0;
  }
  ~GuardedBytes() { munmap(first_, whole_); }
  GuardedBytes(const GuardedBytes&) = delete;
  GuardedBytes& operator=(const GuardedBytes&) = delete;

  [[nodiscard]] void* data() const { return page_ + offset_; }
  /// Whether the bytes beside those that are given are as they were.
  [[nodiscard]] bool rest_is_whole() const {
    for (std::size_t i = 0; i < inner_; ++i) {
      const bool given = i >= offset_ && i < offset_ + size_;
      if (!given && page_[i] != std::byte{kPattern}) return false;
    }
    return true;
  }

 private:
  static constexpr unsigned char kPattern = 0xa5;
  std::size_t size_, inner_ = 0, whole_ = 0, offset_ = 0;
  std::byte* first_ = nullptr;
  std::byte* page_ = nullptr;
};

constexpr std::array<PictureSize, 9> kSizes{{{1, 1},
                                             {3, 2},
                                             {17, 5},
                                             {63, 33},
                                             {257, 31},
                                             {400, 600},
                                             {550, 760},
                                             {800, 600},
                                             {1100, 760}}};

}  // namespace

TEST_CASE("pixels that the driver hands over stay within the memory that is there for them") {
  if (!have_gl()) return;
  for (const auto& size : kSizes) {
    CAPTURE(size.width);
    CAPTURE(size.height);
    const RenderTarget target(size);
    const auto width = static_cast<std::size_t>(size.width);
    const auto height = static_cast<std::size_t>(size.height);
    for (const auto at : {GuardedBytes::At::begin, GuardedBytes::At::end}) {
      glBindFramebuffer(GL_READ_FRAMEBUFFER, target.framebuffer());
      // As RenderTarget::read_rgb.
      const GuardedBytes rgb(3 * width * height, at);
      glPixelStorei(GL_PACK_ALIGNMENT, 1);
      glReadPixels(0, 0, size.width, size.height, GL_RGB, GL_UNSIGNED_BYTE, rgb.data());
      CHECK(rgb.rest_is_whole());
      // As RenderTarget::read_depth, and as CastRenderer::read_end_depth of a part.
      glPixelStorei(GL_PACK_ALIGNMENT, 4);
      for (const int inset : {0, 1, 7, 100}) {
        const int wide = size.width - inset, high = size.height - inset;
        if (wide < 1 || high < 1) continue;
        const auto part = static_cast<std::size_t>(wide) * static_cast<std::size_t>(high);
        const GuardedBytes depth(part * sizeof(float), at);
        glReadPixels(inset, inset, wide, high, GL_DEPTH_COMPONENT, GL_FLOAT, depth.data());
        CHECK(depth.rest_is_whole());
        const GuardedBytes whole(width * height * sizeof(float), at);
        const std::size_t skipped = static_cast<std::size_t>(inset) * (width + 1) * sizeof(float);
        glPixelStorei(GL_PACK_ROW_LENGTH, size.width);
        glReadPixels(inset, inset, wide, high, GL_DEPTH_COMPONENT, GL_FLOAT,
                     static_cast<std::byte*>(whole.data()) + skipped);
        glPixelStorei(GL_PACK_ROW_LENGTH, 0);
        CHECK(whole.rest_is_whole());
      }
    }
  }
}

TEST_CASE("pixels that the driver takes are within the memory that holds them") {
  if (!have_gl()) return;
  for (const auto& size : kSizes) {
    CAPTURE(size.width);
    CAPTURE(size.height);
    const auto width = static_cast<std::size_t>(size.width);
    const auto height = static_cast<std::size_t>(size.height);
    const GlTexture2D colour = GlTexture2D::create(), depth = GlTexture2D::create();
    glTextureStorage2D(colour.id(), 1, GL_RGBA8, size.width, size.height);
    glTextureStorage2D(depth.id(), 1, GL_R32F, size.width, size.height);
    for (const auto at : {GuardedBytes::At::begin, GuardedBytes::At::end}) {
      const GuardedBytes pixels(4 * width * height, at);
      glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
      glPixelStorei(GL_UNPACK_ROW_LENGTH, size.width);
      for (const int inset : {0, 1, 7, 100}) {  // as CastRenderer::upload
        const int wide = size.width - inset, high = size.height - inset;
        if (wide < 1 || high < 1) continue;
        const std::byte* const first = static_cast<const std::byte*>(pixels.data()) +
                                       static_cast<std::size_t>(inset) * (width + 1) * 4;
        glTextureSubImage2D(colour.id(), 0, inset, inset, wide, high, GL_RGBA, GL_UNSIGNED_BYTE,
                            first);
        glTextureSubImage2D(depth.id(), 0, inset, inset, wide, high, GL_RED, GL_FLOAT, first);
      }
      glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
      glFinish();
      CHECK(pixels.rest_is_whole());
    }
  }
}

}  // namespace kerf::guarded_pixels_test
