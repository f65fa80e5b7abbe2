// SPDX-License-Identifier: Apache-2.0
#include "record/run/tick_window.hpp"

#include <string>
#include <utility>

#include "shared/segment/layout.hpp"
#include "shared/segment/tick_table.hpp"

namespace kerf {
namespace {

std::string fault_word(std::uint32_t fault) {
  for (const TickCode& code : kTickFaults) {
    if (code.value == fault) return std::string(code.name);
  }
  return "fault-" + std::to_string(fault);
}

}  // namespace

void TickWindow::look_for_fault(const TickRecord& record, std::size_t arm) {
  const std::uint32_t before = std::exchange(faults_[arm], record.fault);
  if (record.fault == 0 || record.fault == before) return;
  add_event((arm == 0 ? "" : "arm-2-") + fault_word(record.fault), record.tick);
}

void TickWindow::add_event(std::string reason, Tick tick) {
  if (events_.size() < kMostKept) events_.push_back({std::move(reason), tick});
}

void TickWindow::append_second(const TickRecord& record) {
  second_[end_ % second_.size()] = record;
  look_for_fault(record, 1);
}

void TickWindow::append(const TickRecord& record) {
  rows_[end_++ % rows_.size()] = record;
  look_for_fault(record, 0);
  if ((record.command & kCommandKind) == kCommandMark) add_event("mark", record.tick);
}

TickWindow::Event TickWindow::take_event() {
  if (events_.empty()) return {};
  Event event = std::move(events_.front());
  events_.pop_front();
  return event;
}

}  // namespace kerf
