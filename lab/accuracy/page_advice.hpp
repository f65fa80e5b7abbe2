// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "lab/accuracy/study.hpp"

namespace kerf::accuracy {

/// The page's part that says what to choose when: fixed sentences, figures of this run. Needs every
/// choice of a whole study.
[[nodiscard]] std::string page_advice(const std::vector<Entry>& entries);

}  // namespace kerf::accuracy
