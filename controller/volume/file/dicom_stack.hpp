// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "controller/volume/file/dicom_pixels.hpp"
#include "controller/volume/file/foreign_volume.hpp"

// Frames of DICOM files as one stack: their order, and whether they are even.

namespace kerf::volume {

/// By what slices are put in order.
enum class Order : std::uint8_t { position, location, number };

/// Slices of one size and orientation, in order; a volume, if they are even.
struct Stack {
  double number = 0;
  std::string series, name;
  std::string part;  ///< of a series that is several volumes: what it has alone
  Order order = Order::position;
  std::vector<DicomSlice> slices;
  std::vector<double> depth_mm;  ///< of each, along the normal; or numbers
};

/// What a slice is called in a message.
[[nodiscard]] std::string name_of(const DicomSlice& slice);

/// Of one size, and of one orientation or none, but for rounding.
[[nodiscard]] bool alike(const DicomSlice& a, const DicomSlice& b);

/// Sorts the slices by their positions; if none has one, by SliceLocation if that differs, else by
/// number. Throws LoadError if only some have a position.
void put_in_order(Stack& stack);

/// Index of the first slice at the position of the one before it; 0 if there is none.
[[nodiscard]] std::size_t doubled(const Stack& stack);

/// Sentences for the user, each once.
class Note {
 public:
  void add(const std::string& sentence) {
    constexpr std::size_t kMost = 64;  // more than a claim has room for
    if (sentence.empty() || sentences_.size() == kMost) return;
    if (std::ranges::find(sentences_, sentence) != sentences_.end()) return;
    sentences_.push_back(sentence);
  }
  void write(UntrustedHeader& claim) const {
    for (const std::string& sentence : sentences_) add_note(claim, sentence);
  }

 private:
  std::vector<std::string> sentences_;
};

/// Whether the slices, of which none may be at the position of another, are one regular grid.
[[nodiscard]] bool is_regular(const Stack& stack);

/// The frame of the volume; `path` begins messages. Throws LoadError for what is not one even
/// stack.
[[nodiscard]] UntrustedHeader claim_of(const std::filesystem::path& path, const Stack& stack,
                                       Note& note);

}  // namespace kerf::volume
