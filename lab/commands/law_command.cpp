// SPDX-License-Identifier: Apache-2.0
#include <memory>
#include <ostream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "controller/law/registry/law_registry.hpp"
#include "controller/run/law_trial.hpp"
#include "lab/run/lab_command.hpp"
#include "shared/text/text.hpp"

namespace kerf::laws {
namespace {

/// `kerf-lab laws`: the laws that this program knows, each tried at its extremes.
class LawsCommand final : public LabCommand {
 public:
  explicit LawsCommand(Arguments& program);
  [[nodiscard]] int run(std::ostream& out) const override;

 private:
  std::string name_;
};

LawsCommand::LawsCommand(Arguments& program)
    : LabCommand(program, "laws",
                 "each force law, velocity estimator and stabiliser at its extremes") {
  app_.option("name", name_, "only this one").shown_as("NAME");
}

int LawsCommand::run(std::ostream& out) const {
  std::vector<const LawRow*> chosen;
  std::vector<std::string_view> known;
  for (const LawKind kind : {LawKind::force, LawKind::velocity, LawKind::stabiliser}) {
    for (const LawRow* row : known_laws(kind)) {
      known.push_back(row->name);
      if (name_.empty() || name_ == row->name) chosen.push_back(row);
    }
  }
  if (chosen.empty()) throw std::runtime_error("law " + name_ + unknown_word(name_, known));
  bool fine = true;
  for (const LawRow* row : chosen) {
    const std::string law = std::string(kind_name(row->kind)) + " " + std::string(row->name);
    for (const LawTrial& trial : try_law(*row)) {
      fine &= trial.fault.empty();
      out << law << " (" << trial.numbers << "): "
          << (trial.fault.empty()
                  ? format("fine in %llu steps of %.0f ns",
                           static_cast<unsigned long long>(trial.steps), trial.step_ns)
                  : trial.fault)
          << '\n';
    }
  }
  return fine ? 0 : 1;
}

}  // namespace
}  // namespace kerf::laws

std::unique_ptr<kerf::LabCommand> kerf::make_laws_command(Arguments& program) {
  return std::make_unique<laws::LawsCommand>(program);
}
