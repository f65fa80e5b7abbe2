// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "include/kerf/hand.hpp"
#include "include/kerf/log.hpp"
#include "include/kerf/scene.hpp"
#include "include/kerf/servo.hpp"
#include "python/module/law.hpp"
#include "python/module/module.hpp"

namespace py = pybind11;

namespace kerf::python {
namespace {

/// The hand of one arm: the files that it comes from.
struct HandFiles {
  std::optional<std::filesystem::path> script;  ///< none: that of the scene
  std::filesystem::path faults;                 ///< empty: none

  friend bool operator==(const HandFiles&, const HandFiles&) = default;
  [[nodiscard]] Hand open(const Scene& scene, std::size_t arm) const {
    return script ? Hand(scene, *script, faults, arm) : Hand::with_faults(scene, faults, arm);
  }
};

/// All that a hand has got from its loop up to a tick: so it can be brought there again. 8 bytes a
/// tick and arm.
struct Sent {
  std::array<std::int16_t, 3> dac_counts;
  std::uint8_t phase;
  bool motors_on;
};
struct Led {
  Tick tick = 0;
  std::size_t arm = 0;
  std::array<double, 3> tip_mm;
  bool button = false;
};
struct HandHistory {
  /// 80 MB an arm; a loop that ran on for longer has no snapshot.
  static constexpr std::size_t kMostTicks = 10'000'000;

  std::array<std::vector<Sent>, 2> sent;  ///< by arm
  std::vector<Led> led;
  bool whole = true;
};

Sent sent_of(const TickRecord& tick) {
  return {{tick.dac_counts[0], tick.dac_counts[1], tick.dac_counts[2]},
          static_cast<std::uint8_t>(tick.phase),
          (tick.flags & kFlagMotorsOn) != 0};
}

TickRecord record_of(const Sent& sent, Tick tick) {
  TickRecord record{};
  record.tick = tick;
  std::copy(sent.dac_counts.begin(), sent.dac_counts.end(), record.dac_counts);
  record.phase = sent.phase;
  record.flags = sent.motors_on ? kFlagMotorsOn : 0;
  return record;
}

/// `kerf.State`: a loop between two ticks. Shared, never changed.
struct LoopState {
  Servo::State servo;
  HandHistory hands;
  std::vector<HandFiles> files;
  Tick tick = 0;
};

/// Rows of a run as it goes on; at its end an array has them. They grow by half, which moves no
/// byte of a large block.
class Rows {
 public:
  explicit Rows(std::size_t arms) : arms_(arms) {}
  ~Rows() { std::free(data_); }
  Rows(const Rows&) = delete;
  Rows& operator=(const Rows&) = delete;

  /// The last tick of all arms. Throws Error if there is no memory.
  void add(const Servo& servo) {
    if (count_ == room_) grow();
    for (std::size_t arm = 0; arm < arms_; ++arm) {
      std::memcpy(data_ + (count_ * arms_ + arm) * sizeof(TickRecord), &servo.last(arm),
                  sizeof(TickRecord));
    }
    ++count_;
  }

  /// (rows,), of two arms (rows, 2); it has the memory then.
  [[nodiscard]] py::object array() && {
    static const auto* const type = new py::dtype(py::reinterpret_borrow<py::dtype>(row_type()));
    const auto rows = static_cast<py::ssize_t>(count_), arms = static_cast<py::ssize_t>(arms_);
    const std::vector<py::ssize_t> shape = arms_ == 1 ? std::vector{rows} : std::vector{rows, arms};
    if (data_ == nullptr) return py::array(*type, shape);
    const py::capsule owner(data_, [](void* data) { std::free(data); });
    return py::array(*type, shape, {}, std::exchange(data_, nullptr), owner);
  }

 private:
  void grow() {
    const std::size_t room = room_ == 0 ? 1 : room_ < kFew ? kFew : room_ + room_ / 2;
    void* const grown = std::realloc(data_, room * arms_ * sizeof(TickRecord));
    if (grown == nullptr) {
      throw Error("run: no memory for more than " + std::to_string(count_) +
                  " rows; keep fewer by every=1000, or run a part at a time");
    }
    data_ = static_cast<char*>(grown);
    room_ = room;
  }

  static constexpr std::size_t kFew = 256;
  std::size_t arms_;
  char* data_ = nullptr;
  std::size_t count_ = 0, room_ = 0;
};

/// A servo and its hands. One thread at a time: `Busy` refuses a second one.
class Loop {
 public:
  /// With a function, `scene` has the law `python`. An empty `log`: none is written.
  Loop(const Scene& scene, std::vector<HandFiles> files, const std::filesystem::path& log,
       const std::optional<py::function>& law)
      : scene_(scene), files_(std::move(files)), servo_(std::make_shared<Servo>(scene)) {
    if (law) law_.emplace(*law);
    open_hands();
    if (!log.empty()) log_.emplace(log, scene);
  }

  /// Up to `ticks` more of them; `last` gets the rows of each `every`th tick. Throws what a
  /// signal's handler raises.
  void run(std::uint64_t ticks, std::uint64_t every) {
    const Busy busy(*this);
    refuse_failed_law();
    Rows rows(arms());
    bool stopped = false;
    std::exception_ptr thrown;
    try {
      for (std::uint64_t done = 0; done < ticks && !stopped;) {
        const std::uint64_t part = std::min(ticks - done, kTicksBetweenSignals);
        std::optional<py::gil_scoped_release> unlocked;
        if (!law_) unlocked.emplace();
        for (std::uint64_t i = 0; i < part && !stopped; ++i) {
          step_once();
          if (every != 0 && tick() % every == 0) rows.add(*servo_);
          if (law_) stopped = law_->failed() || law_->take_interrupt();
        }
        unlocked.reset();
        done += part;
        if (!stopped) handle_signals();
      }
    } catch (...) {
      thrown = std::current_exception();
    }
    rows_ = std::move(rows).array();
    if (thrown) std::rethrow_exception(thrown);
    if (stopped && law_->failed()) law_->raise(tick());
    if (stopped) throw_keyboard_interrupt();
  }

  /// One tick; its row, of two arms an array of both.
  py::object step() {
    const Busy busy(*this);
    refuse_failed_law();
    step_once();
    if (law_ && law_->failed()) law_->raise(tick());
    return row();
  }

  [[nodiscard]] py::object row() const {
    Rows rows(arms());
    rows.add(*servo_);
    return std::move(rows).array()[py::int_(0)];
  }
  [[nodiscard]] py::object rows() const { return rows_ ? rows_ : Rows(arms()).array(); }
  [[nodiscard]] Tick tick() const noexcept { return servo_->last().tick; }
  [[nodiscard]] std::size_t arms() const noexcept { return servo_->arms(); }

  /// [z, y, x]; the servo lives on with it.
  [[nodiscard]] py::object volume(std::size_t number) const {
    const VoxelView view = view_of(number);
    const py::capsule owner(new std::shared_ptr<Servo>(servo_),
                            [](void* kept) { delete static_cast<std::shared_ptr<Servo>*>(kept); });
    py::object array = py::array_t<std::uint16_t>({view.size[2], view.size[1], view.size[0]},
                                                  view.density.data(), owner);
    make_read_only(array);
    return array;
  }
  [[nodiscard]] py::dict grid(std::size_t number) const {
    const VoxelView view = view_of(number);
    py::dict grid;
    grid["spacing_mm"] = view.spacing_mm;
    grid["origin_mm"] = view.origin_mm;
    grid["orientation"] = view.orientation;
    return grid;
  }
  [[nodiscard]] std::uint64_t volume_hash() const { return servo_->volume_hash(); }

  bool apply(const std::string& name, std::uint32_t argument, std::uint32_t arm) {
    const Busy busy(*this);
    using Kind = ServoCommand::Kind;
    static constexpr std::pair<const char*, Kind> kKinds[] = {{"select_tool", Kind::select_tool},
                                                              {"hold", Kind::hold},
                                                              {"fade_in", Kind::fade_in},
                                                              {"reset", Kind::reset},
                                                              {"undo", Kind::undo},
                                                              {"redo", Kind::redo},
                                                              {"mark", Kind::mark},
                                                              {"missed", Kind::missed}};
    const auto* const kind =
        std::ranges::find(kKinds, name, [](const auto& pair) { return pair.first; });
    if (kind == std::end(kKinds)) {
      std::string all;
      for (const auto& [known, value] : kKinds)
        all += (all.empty() ? "" : ", ") + std::string(known);
      throw Error("apply: no command " + name + "; they are " + all);
    }
    return servo_->apply({kind->second, argument, arm});
  }

  void lead(const std::array<double, 3>& tip_mm, bool button, std::size_t arm) {
    const Busy busy(*this);
    Hand& hand = hand_of(arm);
    hand.lead(tip_mm, button);
    if (history_.whole && history_.led.size() < HandHistory::kMostTicks) {
      history_.led.push_back({tick(), arm, tip_mm, button});
    } else {
      history_.whole = false;
    }
  }
  [[nodiscard]] bool hand_ended(std::size_t arm) { return hand_of(arm).ended(); }
  [[nodiscard]] std::array<double, 3> hand_tip_mm(std::size_t arm) { return hand_of(arm).tip_mm(); }
  [[nodiscard]] std::array<double, 3> motor_force_n(std::size_t arm) {
    return hand_of(arm).motor_force_n();
  }

  [[nodiscard]] std::shared_ptr<const LoopState> snapshot() {
    const Busy busy(*this);
    if (!history_.whole) {
      throw Error("snapshot, tick " + std::to_string(tick()) +
                  ": the hand can be brought back over " + std::to_string(HandHistory::kMostTicks) +
                  " ticks; take it earlier");
    }
    return std::make_shared<LoopState>(LoopState{servo_->keep(), history_, files_, tick()});
  }
  void restore(const LoopState& state) {
    const Busy busy(*this);
    if (log_)
      throw Error("restore: the loop writes a log, which is of one run; restore one without");
    if (state.files != files_) {
      throw Error("restore: the state is of a loop with another hand; give both the same");
    }
    servo_->restore(state.servo);
    history_ = state.hands;
    const py::gil_scoped_release unlocked;
    hands_.clear();
    open_hands();
    bring_back_hands(state.tick);
  }

  [[nodiscard]] py::object law() const { return law_ ? py::object(law_->function()) : py::none(); }
  /// `scene`: this loop's, with the law `python`. Before the first tick, or in place of another
  /// function.
  void set_law(const std::optional<py::function>& function, const Scene& scene) {
    const Busy busy(*this);
    if (function.has_value() != law_.has_value()) {
      const std::string done = std::to_string(tick());
      if (tick() > 0) {
        throw Error(
            "law: the loop has made " + done +
            " ticks with its scene's own, or with a function; make another Loop(scene, law=...)");
      }
      if (log_)
        throw Error("law: the log has begun with another one; give it to Loop(scene, law=...)");
      servo_ = std::make_shared<Servo>(scene);
      scene_ = scene;
    }
    law_.reset();
    if (function) law_.emplace(*function);
  }

  void close() {
    const Busy busy(*this);
    if (log_) log_->close();
  }

 private:
  /// Two threads in one loop would step it with one tick's numbers half written.
  class Busy {
   public:
    explicit Busy(Loop& loop) : loop_(loop) {
      if (loop.busy_.exchange(true)) {
        throw Error(
            "loop: it is busy in another thread or in its own law; make one loop for each thread");
      }
    }
    ~Busy() { loop_.busy_ = false; }
    Busy(const Busy&) = delete;
    Busy& operator=(const Busy&) = delete;

   private:
    Loop& loop_;
  };

  static constexpr std::uint64_t kTicksBetweenSignals = 1000;  // some ms

  void open_hands() {
    for (std::size_t arm = 0; arm < files_.size(); ++arm) {
      hands_.push_back(files_[arm].open(scene_, arm));
    }
  }
  Hand& hand_of(std::size_t arm) {
    if (arm < hands_.size()) return hands_[arm];
    throw Error("arm " + std::to_string(arm) + ": the loop has " + std::to_string(hands_.size()) +
                "; they count from 0");
  }
  [[nodiscard]] VoxelView view_of(std::size_t number) const {
    VoxelView view = servo_->voxels(number);
    if (view.density.empty()) {
      throw Error("volume " + std::to_string(number) + ": the scene has " +
                  std::to_string(scene_.volumes().size()) + "; they count from 0");
    }
    return view;
  }
  void refuse_failed_law() {
    if (law_ && law_->failed()) law_->raise(tick());
  }

  void step_once() {
    const std::size_t arms = hands_.size();
    std::array<DeviceReport, 2> reports;
    for (std::size_t arm = 0; arm < arms; ++arm) {
      const TickRecord& last = servo_->last(arm);
      remember(arm, last);
      reports[arm] = hands_[arm].next(last);
    }
    const LawInUse law(law_ ? &*law_ : nullptr);
    const auto ticks = servo_->step(std::span(reports).first(arms));
    if (log_) log_->add(ticks);
  }
  void remember(std::size_t arm, const TickRecord& last) {
    if (!history_.whole) return;
    if (history_.sent[arm].size() == HandHistory::kMostTicks) {
      history_ = {};
      history_.whole = false;
    } else {
      history_.sent[arm].push_back(sent_of(last));
    }
  }
  /// The hands do again what they did in these ticks.
  void bring_back_hands(Tick ticks) {
    auto led = history_.led.begin();
    for (Tick tick = 0; tick < ticks; ++tick) {
      for (; led != history_.led.end() && led->tick == tick; ++led) {
        hands_[led->arm].lead(led->tip_mm, led->button);
      }
      for (std::size_t arm = 0; arm < hands_.size(); ++arm) {
        static_cast<void>(hands_[arm].next(record_of(history_.sent[arm][tick], tick)));
      }
    }
    for (; led != history_.led.end(); ++led) hands_[led->arm].lead(led->tip_mm, led->button);
  }

  Scene scene_;
  std::vector<HandFiles> files_;  ///< by arm
  std::shared_ptr<Servo> servo_;  ///< with the views of its volumes
  std::vector<Hand> hands_;
  HandHistory history_;
  std::optional<LawFunction> law_;
  std::optional<LogWriter> log_;
  py::object rows_;
  std::atomic<bool> busy_ = false;
};

}  // namespace

void define_loop(py::module_& module) {
  py::class_<HandFiles>(module, "HandFiles")
      .def(py::init<std::optional<std::filesystem::path>, std::filesystem::path>());
  py::class_<LoopState, std::shared_ptr<LoopState>>(module, "State",
                                                    "A loop between two ticks, of Loop.snapshot().")
      .def_readonly("tick", &LoopState::tick, "after which it was taken");
  py::class_<Loop>(module, "Loop")
      .def(py::init<const Scene&, std::vector<HandFiles>, const std::filesystem::path&,
                    const std::optional<py::function>&>())
      .def("_run", &Loop::run)
      .def("step", &Loop::step)
      .def_property_readonly("last", &Loop::row)
      .def_property_readonly("ticks", &Loop::rows)
      .def_property_readonly("tick", &Loop::tick)
      .def_property_readonly("arms", &Loop::arms)
      .def("volume", &Loop::volume, py::arg("number") = 0)
      .def("grid", &Loop::grid, py::arg("number") = 0)
      .def("volume_hash", &Loop::volume_hash)
      .def("apply", &Loop::apply, py::arg("command"), py::arg("argument") = 0, py::arg("arm") = 0)
      .def("lead", &Loop::lead, py::arg("tip_mm"), py::arg("button") = false, py::arg("arm") = 0)
      .def("hand_ended", &Loop::hand_ended, py::arg("arm") = 0)
      .def("hand_tip_mm", &Loop::hand_tip_mm, py::arg("arm") = 0)
      .def("motor_force_n", &Loop::motor_force_n, py::arg("arm") = 0)
      .def("snapshot",
           [](Loop& loop) { return std::const_pointer_cast<LoopState>(loop.snapshot()); })
      .def("restore", &Loop::restore, py::arg("state"))
      .def("_law", &Loop::law)
      .def("_set_law", &Loop::set_law)
      .def("close", &Loop::close);
}

}  // namespace kerf::python
