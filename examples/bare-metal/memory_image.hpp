// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <map>
#include <string>
#include <vector>

#include "examples/bare-metal/arena.hpp"

// Structs and arrays with all that they point to, as data of a program for another memory.

namespace kerf::bare {

/// Where a block goes.
enum class Room : std::uint8_t {
  table,    ///< constant: stays in flash
  state,    ///< changes: in RAM, its first value in flash
  volume,   ///< a state of the size of a volume: start-up copies it by a separate list
  scratch,  ///< changes, and is zero at first: takes no flash
  field,    ///< constant, of the size of a volume: in flash, beside the volumes' first contents
  first     ///< the first content of a block of the room `volume`, in flash
};

/// A block of the image. `bytes` of two copies, made in two arenas: a word that is the same in both
/// counts as a number; one that differs by the distance of the arenas is a pointer.
struct ImageBlock {
  std::size_t offset = 0, bytes = 0, align = 1;
  std::string name;          ///< a symbol; empty: only other blocks point here
  bool wanted = false;       ///< something points here
  bool is_constant = false;  ///< the loop only reads it
  bool is_volume = false;
  std::size_t first_of = 0;  ///< 1 + index of the volume whose first content this is
};

/// Writes what is reached from its roots as assembler text: every pointer by the name of a block,
/// so that the linker of the image chooses the addresses. Needs no list of the structs' members.
///
/// Errors end the program with one line: a word that differs between the arenas and is no pointer
/// into them, or one to no block; in a root with a name, a word that is an address of this program
/// and has no symbol (`name_word`). Not found: a pointer to memory that lies in no arena. It is the
/// same in both copies, so it is written as a number, which means nothing in the image. Scenes must
/// be made without such memory: what is made once and lives on belongs into an arena or
/// `name_word`.
class MemoryImage {
 public:
  MemoryImage(const Arena& first, const Arena& second);

  /// A part of a block of the first arena becomes a block of its own, with a symbol if it has a
  /// name; the rest of that block is not part of the image. All of them before the first `reach`.
  void add_root(const void* at, std::size_t bytes, std::size_t align, std::string name = {});
  /// The word at this address of the first arena is this symbol of the image: functions and what
  /// lies in no arena.
  void name_word(const void* at, std::string symbol);
  /// What lies in no arena, and points nowhere: a constant of the program under a symbol.
  void add_constant(const void* at, std::size_t bytes, std::string name);
  /// The block here is an array over the voxels of a volume, or their bricks; constant, or not.
  void make_volume(const void* at, bool constant);
  /// A constant block with the content that a volume has at first: it is in flash once.
  void make_first(const void* at, const void* of);
  /// All that the root here points to, directly or not, is part of the image. Constants first: what
  /// a constant points to is constant.
  void reach(const void* root, bool constant);

  /// Sections .kerf_tables, .kerf_state, .kerf_first (of the volumes), .kerf_volume and
  /// .kerf_scratch; and from `kerf_copies` to `kerf_copies_end` what start-up copies to the
  /// volumes: to, from, bytes.
  void write(std::FILE* out) const;

 private:
  [[nodiscard]] std::size_t offset_of(const void* at) const;
  [[nodiscard]] std::size_t block_at(std::size_t offset) const;
  [[nodiscard]] std::uint32_t word(const Arena& of, std::size_t offset) const;
  /// Index + 1 of the block that the word at this offset points to; 0: it is a number.
  [[nodiscard]] std::size_t pointed_at(std::size_t offset, std::size_t& into) const;
  [[nodiscard]] Room room_of(const ImageBlock& block) const;
  void write_block(const ImageBlock& block, std::FILE* out) const;
  [[nodiscard]] std::string label_of(std::size_t index) const;

  struct Constant {
    const std::byte* at;
    std::size_t bytes;
    std::string name;
  };

  const Arena& first_;
  const Arena& second_;
  std::vector<ImageBlock> blocks_;  ///< by offset
  std::map<std::size_t, std::string> named_words_;
  std::vector<Constant> constants_;
};

}  // namespace kerf::bare
