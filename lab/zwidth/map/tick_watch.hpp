// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <list>
#include <mutex>
#include <string>
#include <thread>

#include "lab/zwidth/map/tick_meter.hpp"
#include "shared/posix/endless_step.hpp"

namespace kerf::zwidth {

/// Looks after the threads that measure. Where a step of one does not end, as in a law that loops,
/// nothing ends that thread: the program says which law it was, and ends with 2.
class TickWatch {
  struct Measured {
    EndlessStep step;
    std::string what;
  };

 public:
  /// `results` is held while the program ends, so that no file is left half written.
  explicit TickWatch(std::mutex& results);

  /// While it lives, the thread that made it is looked after.
  class Watched {
   public:
    Watched(TickWatch& watch, const TickMeter& ticks, std::string what);
    ~Watched();
    Watched(const Watched&) = delete;
    Watched& operator=(const Watched&) = delete;

   private:
    TickWatch& watch_;
    std::list<Measured>::iterator place_;
  };

 private:
  void look();

  std::mutex& results_;
  std::mutex lock_;
  std::list<Measured> measured_;
  std::jthread thread_;  // last: it ends before what it looks at
};

}  // namespace kerf::zwidth
