// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstring>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include <gdcmDataSet.h>
#include <gdcmSequenceOfItems.h>

#include "controller/volume/file/dicom_header.hpp"
#include "shared/text/text.hpp"

// Elements of a DICOM data set as texts and numbers; for dicom_*.cpp, since it has headers of GDCM.

namespace kerf::volume {

/// A reason why a file is no part of a volume, and the way out.
struct Unfit {
  std::string reason, way_out;
};

/// Without the padding to an even length.
inline std::string trimmed(std::string_view text) {
  constexpr std::string_view kPadding{" \0", 2};
  const std::size_t first = text.find_first_not_of(kPadding);
  if (first == text.npos) return {};
  return std::string(text.substr(first, text.find_last_not_of(kPadding) + 1 - first));
}

[[nodiscard]] std::optional<WrittenNumber> written_number(std::string_view padded);

/// As many numbers as asked for, with backslashes between; none if any part is something else.
template <std::size_t N>
std::optional<std::array<WrittenNumber, N>> written_numbers(std::string_view text) {
  std::array<WrittenNumber, N> numbers{};
  for (std::size_t i = 0; i < N; ++i) {
    const std::size_t end = text.find('\\');
    if ((end == text.npos) != (i + 1 == N)) return std::nullopt;
    const auto number = written_number(text.substr(0, end));
    if (!number) return std::nullopt;
    numbers[i] = *number;
    if (end != text.npos) text.remove_prefix(end + 1);
  }
  return numbers;
}

inline std::string_view bytes_of(const gdcm::DataElement& element) {
  const gdcm::ByteValue* value = element.GetByteValue();
  if (value == nullptr || value->GetPointer() == nullptr) return {};
  return {value->GetPointer(), value->GetLength()};
}

inline std::string text_of(const gdcm::DataElement& element) {
  return trimmed(bytes_of(element));
}

/// Number `at` of an element of binary numbers.
template <class T>
std::optional<T> binary(const gdcm::DataElement& element, std::size_t at = 0) {
  const std::string_view bytes = bytes_of(element);
  if (bytes.size() < (at + 1) * sizeof(T)) return std::nullopt;
  T value{};
  std::memcpy(&value, bytes.data() + at * sizeof(T), sizeof value);
  return value;
}

/// Data set of an item of a sequence, from 0; none if there is no such item.
inline std::optional<gdcm::DataSet> item(const gdcm::DataSet& set, const gdcm::Tag& sequence,
                                         std::size_t at) {
  if (!set.FindDataElement(sequence) || set.GetDataElement(sequence).IsEmpty()) return {};
  const auto items = set.GetDataElement(sequence).GetValueAsSQ();
  if (!items || at >= items->GetNumberOfItems()) return {};
  return items->GetItem(at + 1).GetNestedDataSet();
}

/// The first items of the sequences of a data set, each parsed once: a file may have thousands of
/// frames, which share some of them.
class Groups {
 public:
  /// `set` outlives the object; null holds nothing.
  explicit Groups(const gdcm::DataSet* set) : set_(set) {}

  /// Null if there is no such sequence.
  [[nodiscard]] const gdcm::DataSet* find(const gdcm::Tag& sequence) const {
    if (set_ == nullptr || !set_->FindDataElement(sequence)) return nullptr;
    const auto [at, is_new] = items_.try_emplace(sequence);
    if (is_new) at->second = item(*set_, sequence, 0);
    return at->second ? &*at->second : nullptr;
  }
  [[nodiscard]] const gdcm::DataSet& all() const { return *set_; }

 private:
  const gdcm::DataSet* set_;
  mutable std::map<gdcm::Tag, std::optional<gdcm::DataSet>> items_;
};

/// The facts of one frame: its own functional groups, those of all frames, the top of the file.
class Facts {
 public:
  /// `shared` and `top` outlive the object, as what `own` refers to does.
  Facts(const gdcm::DataSet* own, const Groups& shared, const Groups& top)
      : own_(own), shared_(shared), top_(top) {}

  /// An element, in the sequence `group` or, of older files, on the top of the file.
  [[nodiscard]] gdcm::DataElement find(const gdcm::Tag& group, const gdcm::Tag& tag) const {
    for (const Groups* level : {&own_, &shared_, &top_}) {
      const gdcm::DataSet* inside = level->find(group);
      if (inside != nullptr && inside->FindDataElement(tag)) return inside->GetDataElement(tag);
    }
    return top_.all().GetDataElement(tag);
  }
  [[nodiscard]] std::string text(const gdcm::Tag& group, const gdcm::Tag& tag) const {
    return text_of(find(group, tag));
  }
  /// Null unless any level has the sequence.
  [[nodiscard]] const gdcm::DataSet* group(const gdcm::Tag& sequence) const {
    for (const Groups* level : {&own_, &shared_, &top_}) {
      if (const gdcm::DataSet* inside = level->find(sequence)) return inside;
    }
    return nullptr;
  }

 private:
  Groups own_;
  const Groups &shared_, &top_;
};

/// Fills in the frames of a file, whose `pixels` are known, and what the user should know of them.
/// In dicom_frames.cpp. Throws Unfit.
void read_frames(const gdcm::DataSet& set, std::size_t count, DicomFile& file);

}  // namespace kerf::volume
