// SPDX-License-Identifier: Apache-2.0
// Which sets of kernels a program runs, and what is known of all of them on any processor.
#include <algorithm>
#include <cstdlib>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <doctest/doctest.h>

#include "controller/kernel/kernel_set.hpp"
#include "controller/kernel/kernel_shapes.hpp"
#include "shared/numeric/hidden_set.hpp"
#include "tests/support/sets_to_run.hpp"

namespace kerf::kernel_sets_test {

using namespace kerf::test;

namespace {

constexpr const char* kVariable = "KERF_HIDE_SETS";

/// The variable with another value, or unset, as long as this lives.
class Hidden {
 public:
  explicit Hidden(const char* names) {
    const char* const before = std::getenv(kVariable);  // NOLINT(concurrency-mt-unsafe)
    was_set_ = before != nullptr;
    if (was_set_) before_ = before;
    set(names);
  }
  ~Hidden() { set(was_set_ ? before_.c_str() : nullptr); }
  Hidden(const Hidden&) = delete;
  Hidden& operator=(const Hidden&) = delete;

 private:
  static void set(const char* names) {
    // NOLINTBEGIN(concurrency-mt-unsafe): one thread
    static_cast<void>(names == nullptr ? unsetenv(kVariable) : setenv(kVariable, names, 1));
    // NOLINTEND(concurrency-mt-unsafe)
  }

  bool was_set_ = false;
  std::string before_;
};

std::vector<std::string> names_here() {
  std::vector<std::string> names;
  for (auto set = kernel_sets(); *set != nullptr; ++set) names.emplace_back((*set)->name);
  return names;
}

}  // namespace

TEST_CASE("a hidden set is not run, the others stay in their order, scalar always") {
  std::vector<std::string> all;
  {
    const Hidden none(nullptr);
    all = names_here();
  }
  const auto without = [&](const std::vector<std::string>& hidden) {
    std::vector<std::string> rest;
    for (const std::string& name : all) {
      if (std::ranges::find(hidden, name) == hidden.end()) rest.push_back(name);
    }
    return rest;
  };
  const std::vector<std::string> vectors{"avx512", "avx2", "neon"};
  for (const std::string& one : vectors) {
    CAPTURE(one);
    for (const std::string& names : {one, one + ",scalar", "sse1," + one, one + "," + one,
                                     one + ",", "," + one, "avx," + one, " sse1, " + one}) {
      CAPTURE(names);
      const Hidden hidden(names.c_str());
      CHECK(hidden_set(one.c_str()));
      CHECK(names_here() == without({one}));
    }
    // Another name that begins or ends with it hides nothing.
    for (const std::string& names :
         {std::string(), one + "0", "x" + one, one.substr(1), "," + one + "0",
          one.substr(0, one.size() - 1), std::string("scalar")}) {
      CAPTURE(names);
      const Hidden hidden(names.c_str());
      CHECK(!hidden_set(one.c_str()));
      CHECK(names_here() == all);
    }
  }
  const Hidden hidden("avx512,avx2,neon");
  CHECK(names_here() == without(vectors));
  CHECK(all.back() == "scalar");
}

TEST_CASE("a name that no instruction set has is found, and every set has a name") {
  for (const KernelSet* set : kBuiltSets) {
    CAPTURE(std::string(set->name));
    const Hidden hidden(set->name);
    CHECK(unknown_hidden_set().empty());
  }
  for (const char* const fine : {"", ",", " , ", "avx512,avx2 neon", "scalar,,neon,"}) {
    CAPTURE(std::string(fine));
    const Hidden hidden(fine);
    CHECK(unknown_hidden_set().empty());
  }
  for (const auto& [names, unknown] : {std::pair{"avx51", "avx51"},
                                       {"avx512,avx", "avx"},
                                       {"sse1 avx2", "sse1"},
                                       {"avx2;neon", "avx2;neon"},
                                       {"AVX2", "AVX2"},
                                       {", neon2 ,x", "neon2"}}) {
    CAPTURE(std::string(names));
    const Hidden hidden(names);
    CHECK(unknown_hidden_set() == unknown);
  }
  const Hidden none(nullptr);
  CHECK(unknown_hidden_set().empty());
}

TEST_CASE("every set has the shape by which scenes are planned for it on other processors") {
  for (const KernelSet* set : kBuiltSets) {
    CAPTURE(std::string(set->name));
    const auto* const shape = std::ranges::find_if(kKernelShapes, [&](const KernelShape& one) {
      return std::string_view(one.name) == set->name;
    });
    REQUIRE(shape != std::end(kKernelShapes));
    CHECK(shape->lanes == set->lanes);
    CHECK(shape->can_fuse == set->can_fuse);
  }
}

}  // namespace kerf::kernel_sets_test
