// SPDX-License-Identifier: Apache-2.0
// kerf-arm when two things go wrong at once: a library that hangs, and a signal that asks for the
// end, a device that fails, or a second signal.
#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "tests/support/process.hpp"
#include "tests/support/temporary_folder.hpp"

namespace kerf::arm_pairs_test {

using kerf::test::eventually;
using kerf::test::Process;
using kerf::test::text_of;
using namespace std::chrono_literals;

namespace {

/// Patience of kerf-arm for everything but the end itself: it must not wait for that.
constexpr const char* kPatienceS = "600";
constexpr const char* kPatienceMs = "10000";

struct Pair {
  std::string device, behaviour;
  std::string reached;  ///< the record of the library has this once it hangs
  std::vector<std::string> more;
  std::string says;  ///< the one line about it
};

class Adapter {
 public:
  explicit Adapter(const Pair& pair) {
    setenv("KERF_MOCK", pair.behaviour.c_str(), 1);
    setenv("KERF_MOCK_RECORD", record_.c_str(), 1);
    const std::string library =
        std::string(KERF_TEST_LIBRARIES) +
        (pair.device == "touch" ? "/mock_hd/libHD.so" : "/mock_drd/libdrd.so.3");
    std::vector<std::string> words{std::string(KERF_TEST_BIN) + "/kerf-arm",
                                   "--device",
                                   pair.device,
                                   "--library",
                                   library,
                                   "--opening-s",
                                   kPatienceS};
    if (std::ranges::find(pair.more, "--stall-ms") == pair.more.end()) {
      words.insert(words.end(), {"--stall-ms", kPatienceMs});
    }
    words.insert(words.end(), pair.more.begin(), pair.more.end());
    process_ = std::make_unique<Process>(words, folder_ / "log");
  }
  ~Adapter() {
    unsetenv("KERF_MOCK");
    unsetenv("KERF_MOCK_RECORD");
  }
  Adapter(const Adapter&) = delete;
  Adapter& operator=(const Adapter&) = delete;

  [[nodiscard]] bool has_reached(const std::string& call) const {
    return eventually(
        [&] {
          return std::filesystem::exists(record_) &&
                 text_of(record_).find(call) != std::string::npos;
        },
        20s);
  }
  [[nodiscard]] Process& process() const { return *process_; }
  /// But for the line that says where the arm is.
  [[nodiscard]] std::string said() const {
    std::string all = process_->output();
    if (const auto at = all.find(" at arm:"); at != std::string::npos) {
      all.erase(0, all.find('\n', at) + 1);
    }
    return all;
  }

 private:
  kerf::test::RuntimeFolder folder_;
  std::filesystem::path record_ = folder_ / "record";
  std::unique_ptr<Process> process_;
};

/// One for each pair, all at once: each takes its seconds to end.
class Adapters {
 public:
  explicit Adapters(std::span<const Pair> pairs) {
    for (const Pair& pair : pairs) arms_.push_back(std::make_unique<Adapter>(pair));
  }
  [[nodiscard]] const Adapter& operator[](std::size_t i) const { return *arms_[i]; }

  void end_with_one_line(std::span<const Pair> pairs) const {
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      CAPTURE(pairs[i].device);
      CAPTURE(pairs[i].behaviour);
      Process& arm = arms_[i]->process();
      REQUIRE(arm.ends_within(30s));
      CHECK(arm.wait() == 2);
      const std::string said = arms_[i]->said();
      CAPTURE(said);
      CHECK(said.starts_with("kerf-arm: "));
      CHECK(std::ranges::count(said, '\n') == 1);
      CHECK(said.find(pairs[i].says) != std::string::npos);
    }
  }

 private:
  std::vector<std::unique_ptr<Adapter>> arms_;
};

const std::string kOpening = "does not return from opening",
                  kClosing = "does not return from closing";
const std::vector<std::string> kInit{"--auto-init"}, kSoon{"--stall-ms", "200"};

}  // namespace

TEST_CASE("arm: asked to end while the library hangs, wherever: one line and exit code 2, soon") {
  const Pair pairs[] = {
      {"touch", "hang_open", "hdInitDevice", {}, kOpening},
      {"touch", "hang_start", "hdStartScheduler", {}, kOpening},
      {"touch", "hang_callback=50", "frame 49 ", {}, kClosing},
      {"touch", "hang_stop", "frame 50 ", {}, kClosing},
      {"touch", "hang_close", "frame 50 ", {}, kClosing},
      {"omega", "hang_open", "drdOpen", {}, kOpening},
      {"omega", "hang_init,not_homed", "drdAutoInit", kInit, kOpening},
      {"omega", "hang_start", "dhdEnableForce 1", {}, kOpening},
      {"omega", "hang_callback=50", "force 49 ", {}, kClosing},
      {"omega", "hang_stop", "force 50 ", {}, kClosing},
      {"omega", "hang_close", "force 50 ", {}, kClosing},
  };
  for (const bool twice : {false, true}) {  // an impatient user
    const Adapters arms(pairs);
    for (std::size_t i = 0; i < std::size(pairs); ++i) {
      REQUIRE(arms[i].has_reached(pairs[i].reached));
      arms[i].process().signal(SIGTERM);
      if (twice) arms[i].process().signal(SIGINT);
    }
    arms.end_with_one_line(pairs);
  }
}

TEST_CASE("arm: a device that fails while its library hangs is told first, by one line") {
  const Pair pairs[] = {
      {"touch", "error=302@50,hang_stop", "hdStopScheduler", {}, "error 302"},
      {"touch", "error=302@50,hang_close", "hdDisableDevice", {}, "error 302"},
      {"touch", "hang_callback=50,hang_stop", "hdStopScheduler", kSoon, "callback has stopped"},
      {"touch", "vanish=50,crash_close", "hdDisableDevice", {}, "has crashed"},
      {"omega", "vanish=50,hang_stop", "dhdEnableForce 0", {}, "cannot be read any more"},
      {"omega", "vanish=50,hang_close", "drdClose", {}, "cannot be read any more"},
  };
  for (const bool asked : {false, true}) {
    const Adapters arms(pairs);
    for (std::size_t i = 0; i < std::size(pairs); ++i) {
      REQUIRE(arms[i].has_reached(pairs[i].reached));
      if (asked) arms[i].process().signal(SIGTERM);
    }
    arms.end_with_one_line(pairs);
  }
}

}  // namespace kerf::arm_pairs_test
