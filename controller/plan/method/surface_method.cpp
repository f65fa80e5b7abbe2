// SPDX-License-Identifier: Apache-2.0
#include <optional>
#include <string>

#include "controller/plan/method/methods.hpp"

namespace kerf {
namespace {

/// The swept proxy is felt and nothing is cut: nothing is left to do but its queries.
class SurfaceMethod final : public ToolMethod {
 public:
  constexpr SurfaceMethod() noexcept : ToolMethod(Method::surface, "surface", "") {}

  [[nodiscard]] std::optional<std::string> serves(const ToolCase& in) const override {
    if (in.scene.force.model != ForceModel::proxy) return std::nullopt;
    if (in.scene.cut.model != CutModel::none) return std::nullopt;
    return "its surface alone is felt, and nothing is cut";
  }
};

}  // namespace

const ToolMethod& surface_method() noexcept {
  static constexpr SurfaceMethod kMethod;
  return kMethod;
}

}  // namespace kerf
