// SPDX-License-Identifier: Apache-2.0
#include "lab/stability/map_file.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <system_error>
#include <utility>

#include "controller/stability/sampled_loop.hpp"
#include "hil/hil_error.hpp"
#include "shared/numeric/fnv1a.hpp"
#include "shared/posix/atomic_file.hpp"
#include "shared/text/json.hpp"
#include "shared/text/text.hpp"

namespace kerf::zwidth {
namespace {

constexpr int kFormat = 5;  ///< of a part file
constexpr grid::PartWords kPartWords{
    .option = "--part",
    .busy = "another run is at work on it; wait for that, or name another file",
    .not_opened = "; name another file",
    .not_written = "cannot be written; make room and run again"};

Json json_of(const StabilityBoundary& crossing) {
  return Json{
      {"first", crossing.by_seed_n_per_mm},  // null: never
      {"re_entry", Json::List{crossing.re_entry_from_n_per_mm, crossing.re_entry_to_n_per_mm}}};
}

double stiffness_in(const Json& json) {
  return json.is_null() ? StabilityBoundary::kNever : json.get<double>();
}

StabilityBoundary crossing_in(const Json& json) {
  StabilityBoundary found;
  for (const Json& first : json.at("first")) found.by_seed_n_per_mm.push_back(stiffness_in(first));
  if (!found.by_seed_n_per_mm.empty()) {
    const auto [first, last] = std::ranges::minmax(found.by_seed_n_per_mm);
    found.first_n_per_mm = first;
    found.last_n_per_mm = last;
  }
  found.re_entry_from_n_per_mm = json.at("re_entry").at(0).get<double>();
  found.re_entry_to_n_per_mm = json.at("re_entry").at(1).get<double>();
  return found;
}

std::string line_of(std::size_t index, const Column& column) {
  Json cells = Json::List{};
  for (const LimitCycle& cell : column.cells) {
    cells.push_back(Json::List{cell.swings, cell.active, cell.undecided, cell.arithmetic,
                               cell.travel_mm, cell.given_mj, cell.port_minimum_mj});
  }
  return Json{{"column", index},
              {"cells", std::move(cells)},
              {"swing", json_of(column.swing)},
              {"energy", json_of(column.energy)},
              {"undecided", column.undecided_n_per_mm}}
      .canonical();
}

void take_line(const std::string& line, Part& part) {
  const Json json = Json::parse(line);
  Column column;
  for (const Json& cell : json.at("cells")) {
    column.cells.push_back({cell.at(0).get<bool>(), cell.at(1).get<bool>(), cell.at(2).get<bool>(),
                            cell.at(3).get<bool>(), cell.at(4).get<double>(),
                            cell.at(5).get<double>(), cell.at(6).get<double>()});
  }
  column.swing = crossing_in(json.at("swing"));
  column.energy = crossing_in(json.at("energy"));
  column.undecided_n_per_mm = stiffness_in(json.at("undecided"));
  part.columns[json.at("column").get<std::size_t>()] = std::move(column);
}

std::string head_of(const Part& part) {
  const MapSpec& spec = part.spec;
  Json axes = Json::Members{};
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    if (!spec.table[i].empty()) axes[axis_kinds()[i].name] = spec.table[i];
  }
  return Json{{"kerf_zwidth", kFormat},  {"version", KERF_VERSION},
              {"program", part.program}, {"shard", Json::List{part.shard.index, part.shard.count}},
              {"map", spec.mapped},      {"stiffness_n_per_mm", spec.stiffness_n_per_mm},
              {"axes", std::move(axes)}, {"arm", spec.arm},
              {"seconds", spec.seconds}, {"seed", spec.seed},
              {"seeds", spec.seeds}}
      .canonical();
}

void take_head(const std::string& line, Part& part) {
  const Json json = Json::parse(line);
  if (json.at("kerf_zwidth").get<int>() != kFormat) {
    throw JsonError("kerf_zwidth is not " + std::to_string(kFormat));
  }
  if (json.at("version").get<std::string>() != KERF_VERSION) {
    throw JsonError("of version " + json.at("version").get<std::string>() +
                    ", this is " KERF_VERSION);
  }
  part.program = json.at("program").get<std::string>();
  part.shard = {json.at("shard").at(0).get<std::size_t>(),
                json.at("shard").at(1).get<std::size_t>()};
  MapSpec& spec = part.spec;
  spec.mapped = json.at("map").get<std::array<std::size_t, 2>>();
  spec.stiffness_n_per_mm = json.at("stiffness_n_per_mm").get<std::vector<double>>();
  for (const auto& [name, values] : json.at("axes").members()) {
    spec.table[axis_named("axes", name)] = values.get<std::vector<std::string>>();
  }
  spec.arm = json.at("arm").get<bool>();
  spec.seconds = json.at("seconds").get<double>();
  spec.seed = json.at("seed").get<std::uint64_t>();
  spec.seeds = json.at("seeds").get<std::size_t>();
}

/// A pipe would wait for ever, and /dev/null keeps nothing.
void check_is_file(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::exists(path, error) || std::filesystem::is_regular_file(path, error))
    return;
  throw HilError(path + ": is no file; name one that keeps a part of a map");
}

/// Refuses a head that no map has, as the options refuse it.
void check_spec(const MapSpec& spec) {
  const auto joined = [](const auto& values, const auto& text_of) {
    std::string text;
    for (const auto& value : values) text += (text.empty() ? "" : ",") + text_of(value);
    return text;
  };
  for (std::size_t i = 0; i < kAxisCount; ++i) {
    if (spec.table[i].empty()) continue;
    const std::string text = joined(spec.table[i], [](const std::string& value) { return value; });
    if (axis_values(static_cast<AxisId>(i), text) != spec.table[i]) {
      throw HilError(std::string("--") + axis_kinds()[i].name + ": " + text + " does not rise");
    }
  }
  const std::string stiffnesses = joined(spec.stiffness_n_per_mm, number_text);
  if (stiffness_values(stiffnesses) != spec.stiffness_n_per_mm) {
    throw HilError("--stiffness: " + stiffnesses + " does not rise");
  }
  for (const std::size_t axis : spec.mapped) {
    if (axis < kAxisCount ? spec.table[axis].empty() : axis > kAxisCount) {
      throw HilError("--map: an axis without values");
    }
  }
  if (spec.mapped[0] == spec.mapped[1]) throw HilError("--map: the same axis twice");
  if (!(spec.seconds >= kLimitS && spec.seconds <= kLongestLimitS)) {
    throw HilError("--seconds: not within 60 and 600");
  }
  if (spec.seeds < 1 || spec.seeds > kMostSeeds) {
    throw HilError("--seeds: not within 1 and " + std::to_string(kMostSeeds));
  }
}

/// Identifies the map of a part, without shard and program.
std::string map_of(const Part& part) {
  return head_of({part.spec, {}, {}});
}

std::string shard_text(const Shard& shard) {
  return std::to_string(shard.index) + "/" + std::to_string(shard.count);
}

/// Why the columns of a part are not those of its shard; else empty.
std::string gap_of(const Part& part, std::size_t column_count) {
  std::size_t missing = 0, all = 0;
  for (std::size_t i = 0; i < column_count; ++i) {
    if (!part.shard.has(i)) continue;
    ++all;
    missing += part.columns.contains(i) ? 0 : 1;
  }
  if (missing == 0) return {};
  return "has " + std::to_string(all - missing) + " of its " + std::to_string(all) +
         " columns; run its shard " + shard_text(part.shard) + " again, it resumes";
}

/// A stiffness, or null; 0 and kNever are none.
Json stiffness_json(double n_per_mm) {
  const bool is_one = n_per_mm > 0 && n_per_mm != StabilityBoundary::kNever;
  return is_one ? Json(n_per_mm) : Json(nullptr);
}

/// The crossing of a part of the seeds, by nearest rank.
double seed_at(std::vector<double> by_seed, double part) {
  if (by_seed.empty()) return 0;
  std::ranges::sort(by_seed);
  const auto rank = static_cast<std::size_t>(std::ceil(part * double(by_seed.size())));
  return by_seed[std::max<std::size_t>(1, rank) - 1];
}

Json crossing_json(const Column& column, const StabilityBoundary& crossing) {
  constexpr double kLowPart = 0.05, kHighPart = 0.95;
  Json by_seed = Json::List{};
  for (const double first : crossing.by_seed_n_per_mm) by_seed.push_back(stiffness_json(first));
  const auto reason = [&](double n_per_mm) {
    const std::string text = no_crossing(column, n_per_mm);
    return text.empty() ? Json(nullptr) : Json(text);
  };
  return Json{
      {"first_n_per_mm", stiffness_json(crossing.first_n_per_mm)},
      {"reason", reason(crossing.first_n_per_mm)},
      {"last_n_per_mm", stiffness_json(crossing.last_n_per_mm)},
      {"last_reason", reason(crossing.last_n_per_mm)},
      {"by_seed_n_per_mm", std::move(by_seed)},
      {"band_n_per_mm", Json::List{stiffness_json(seed_at(crossing.by_seed_n_per_mm, kLowPart)),
                                   stiffness_json(seed_at(crossing.by_seed_n_per_mm, kHighPart))}},
      {"re_entry_from_n_per_mm", stiffness_json(crossing.re_entry_from_n_per_mm)},
      {"re_entry_to_n_per_mm", stiffness_json(crossing.re_entry_to_n_per_mm)}};
}

template <class Each>
void each_axis(const Each& each) {
  for (std::size_t i = 0; i < kAxisCount; ++i) each(static_cast<AxisId>(i), axis_kinds()[i]);
}

/// "damping_ns_per_mm" and the like: a name of its own for a unit.
std::string column_name(const AxisKind& kind) {
  const std::string unit = kind.unit;
  if (unit == "N s/mm") return std::string(kind.name) + "_ns_per_mm";
  if (unit == "mm/s") return std::string(kind.name) + "_mm_per_s";
  if (unit.empty()) return kind.name;
  std::string name = std::string(kind.name) + "_" + unit;
  for (char& letter : name) {
    if (letter >= 'A' && letter <= 'Z') letter = static_cast<char>(letter - 'A' + 'a');
  }
  return name;
}

}  // namespace

const std::string& this_program() {
  static const std::string kHash = [] {
    const std::string bytes = text_in("/proc/self/exe");
    if (bytes.empty()) {
      throw HilError(
          "/proc/self/exe: cannot be read, so a part would not tell which program made "
          "it; let the user of this program read it");
    }
    return hex64(fnv1a(bytes));
  }();
  return kHash;
}

std::string part_text(const Part& part) {
  std::string text = head_of(part) + "\n";
  for (const auto& [index, column] : part.columns) text += line_of(index, column) + "\n";
  return text;
}

Part read_part(const std::string& path) {
  check_is_file(path);
  std::ifstream in(path);
  if (!in) throw HilError(path + ": cannot be read; name a part of a map (--part)");
  Part part;
  std::size_t number = 0;
  try {
    for (std::string line; std::getline(in, line); ++number) {
      if (in.eof()) break;  // no end of line: not whole
      if (number == 0) {
        take_head(line, part);
      } else {
        take_line(line, part);
      }
    }
  } catch (const JsonError& error) {
    throw HilError(path + ": line " + std::to_string(number + 1) + " is not one of a map (" +
                   error.what() + "); " + (number > 0 ? "cut it off there, or " : "") +
                   "remove the file to start over");
  }
  if (number == 0) throw HilError(path + ": no part of a map; remove the file to start over");
  if (part.shard.index < 1 || part.shard.index > part.shard.count) {
    throw HilError(path + ": shard " + shard_text(part.shard) +
                   " is no part of a whole; remove the file to start over");
  }
  try {  // also a law that another program has
    check_spec(part.spec);
  } catch (const HilError& error) {
    throw HilError(path + ": " + error.what());
  }
  const std::vector<Assignment> columns = part.spec.columns();
  for (const auto& [index, column] : part.columns) {
    if (index >= columns.size() || !part.shard.has(index)) {
      throw HilError(path + ": has columns that its shard " + shard_text(part.shard) +
                     " has not; remove the file to start over");
    }
    if (!column.cells.empty() && column.cells.size() != part.spec.stiffness_n_per_mm.size()) {
      throw HilError(path + ": column " + std::to_string(index) + " has " +
                     std::to_string(column.cells.size()) + " cells for " +
                     std::to_string(part.spec.stiffness_n_per_mm.size()) +
                     " stiffnesses; remove the file to start over");
    }
  }
  return part;
}

Part merge_parts(const std::vector<std::string>& paths) {
  Part whole;
  std::map<std::size_t, std::string> seen;  // path by shard
  for (const std::string& path : paths) {
    const Part part = read_part(path);
    if (seen.empty()) whole = {part.spec, part.shard, {}, part.program};
    if (map_of(part) != map_of(whole) || part.shard.count != whole.shard.count) {
      const std::string seeds = part.spec.seed == whole.spec.seed
                                    ? std::string("other axes, hits or shards than ")
                                    : "seed " + std::to_string(part.spec.seed) + ", not the " +
                                          std::to_string(whole.spec.seed) + " of ";
      throw HilError(path + ": " + seeds + paths.front() + "; merge shards of one map");
    }
    if (part.program != whole.program) {
      throw HilError(path + ": another program measured it than " + paths.front() +
                     ", which may move other bits; run all shards with one build");
    }
    const auto [other, is_new] = seen.emplace(part.shard.index, path);
    if (!is_new) {
      throw HilError(path + ": shard " + shard_text(part.shard) + " again, as " + other->second +
                     "; name each once");
    }
    const std::string gap = gap_of(part, part.spec.columns().size());
    if (!gap.empty()) throw HilError(path + ": " + gap);
    whole.columns.insert(part.columns.begin(), part.columns.end());
  }
  for (std::size_t i = 1; i <= whole.shard.count; ++i) {
    if (seen.contains(i)) continue;
    throw HilError("--merge: shard " + std::to_string(i) + "/" + std::to_string(whole.shard.count) +
                   " is missing; run it, or name its part");
  }
  whole.shard = {};
  return whole;
}

PartWriter::PartWriter(const std::string& path, const MapSpec& spec, const Shard& shard)
    : part_{spec, shard, {}} {
  if (path.empty()) return;
  check_is_file(path);
  file_.emplace(kPartWords, path);
  if (file_->text().empty()) {
    file_->add(head_of(part_));
    return;
  }
  Part found = read_part(path);
  if (map_of(found) == map_of(part_) && found.program != part_.program) {
    file_->refuse(
        "another program measured it, which may move other bits; name another file, or "
        "remove it to start over");
  }
  if (head_of(found) != head_of(part_)) {
    file_->refuse("has another map or shard; name another file, or remove it to start over");
  }
  part_.columns = std::move(found.columns);
  file_->cut_to_whole_lines();
}

void PartWriter::add(std::size_t index, Column column) {
  if (file_) file_->add(line_of(index, column));
  part_.columns[index] = std::move(column);
}

void PartWriter::finish() {
  if (file_) write_new_file(file_->path(), part_text(part_));
}

Analytic analytic_of(const LoopCase& subject) {
  const SampledLoop& loop = subject.loop;
  const bool is_bare = loop.delay_s <= 0 && subject.damping_ns_per_mm <= 0;
  const bool differs = subject.estimator.name != "difference" ||
                       (subject.law != Law::two_sided && subject.law != Law::linear) ||
                       !subject.stabiliser.name.empty();
  const bool is_passive = !differs && !subject.limits && subject.numeric == NumericKind::float64;
  const bool is_linear =
      is_passive && subject.law == Law::two_sided && loop.coulomb_n == 0 && loop.quantum_mm == 0;
  return {highest_stiffness(loop, subject.damping_ns_per_mm),
          passive_stiffness(loop, subject.damping_ns_per_mm), is_bare ? quantum_stiffness(loop) : 0,
          is_linear, is_passive};
}

std::string no_crossing(const Column& column, double n_per_mm) {
  if (column.cells.empty()) return "not measured";
  if (n_per_mm == 0) return "below all";
  if (n_per_mm != StabilityBoundary::kNever) return {};
  return column.undecided_n_per_mm == StabilityBoundary::kNever ? "above all" : "undecided";
}

std::string csv_of(const Part& part) {
  std::string text;
  each_axis([&](AxisId, const AxisKind& kind) { text += column_name(kind) + ","; });
  text +=
      "stiffness_n_per_mm,swings,active,undecided,arithmetic,travel_mm,given_mj,port_minimum_mj\n";
  const std::vector<Assignment> columns = part.spec.columns();
  for (const auto& [index, column] : part.columns) {
    std::string head;
    each_axis([&](AxisId axis, const AxisKind&) { head += value_of(columns[index], axis) + ","; });
    for (std::size_t i = 0; i < column.cells.size(); ++i) {
      const LimitCycle& cell = column.cells[i];
      text += head + number_text(part.spec.stiffness_n_per_mm[i]) + (cell.swings ? ",1" : ",0") +
              (cell.active ? ",1" : ",0") + (cell.undecided ? ",1" : ",0") +
              (cell.arithmetic ? ",1," : ",0,") + number_text(cell.travel_mm) + "," +
              number_text(cell.given_mj) + "," + number_text(cell.port_minimum_mj) + "\n";
    }
  }
  return text;
}

Json axes_json(const Assignment& values) {
  Json axes = Json::Members{};
  each_axis(
      [&](AxisId axis, const AxisKind& kind) { axes[column_name(kind)] = value_of(values, axis); });
  return axes;
}

std::string json_of(const Part& part) {
  const std::vector<Assignment> assignments = part.spec.columns();
  Json columns = Json::List{};
  for (const auto& [index, column] : part.columns) {
    const Assignment& values = assignments[index];
    const LoopCase subject = subject_of(values);
    const Analytic analytic = analytic_of(subject);
    const std::string why = impossible(part.spec, subject);
    Json cells = Json::List{};
    for (const LimitCycle& cell : column.cells) {
      cells.push_back({{"swings", cell.swings},
                       {"active", cell.active},
                       {"undecided", cell.undecided},
                       {"arithmetic", cell.arithmetic},
                       {"travel_mm", cell.travel_mm},
                       {"given_mj", cell.given_mj},
                       {"port_minimum_mj", cell.port_minimum_mj}});
    }
    columns.push_back({{"axes", axes_json(values)},
                       {"impossible", why.empty() ? Json(nullptr) : Json(why)},
                       {"by_travel", crossing_json(column, column.swing)},
                       {"by_energy", crossing_json(column, column.energy)},
                       {"undecided_from_n_per_mm", stiffness_json(column.undecided_n_per_mm)},
                       {"analytic",
                        {{"exact_n_per_mm", analytic.exact},
                         {"passive_n_per_mm", analytic.passive},
                         {"quantum_n_per_mm", stiffness_json(analytic.quantum)},
                         {"exact_holds", analytic.exact_holds},
                         {"passive_holds", analytic.passive_holds}}},
                       {"cells", std::move(cells)}});
  }
  Json varied = Json::List{};
  each_axis([&](AxisId axis, const AxisKind& kind) {
    if (part.spec.table[index_of(axis)].size() > 1) varied.push_back(kind.name);
  });
  Json mapped = Json::List{};
  for (const std::size_t axis : part.spec.mapped) {
    mapped.push_back(axis == kAxisCount ? "stiffness" : axis_kinds()[axis].name);
  }
  return Json{{"version", KERF_VERSION},      {"seed", part.spec.seed},
              {"seeds", part.spec.seeds},     {"seconds", part.spec.seconds},
              {"whole_arm", part.spec.arm},   {"mapped", std::move(mapped)},
              {"varied", std::move(varied)},  {"stiffness_n_per_mm", part.spec.stiffness_n_per_mm},
              {"columns", std::move(columns)}}
      .document();
}

}  // namespace kerf::zwidth
