// SPDX-License-Identifier: Apache-2.0
#include "examples/bare-metal/memory_image.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

// Of the linker: where this program lies.
extern "C" {
extern const char __executable_start;
extern const char _end;
}

namespace kerf::bare {
namespace {

static_assert(sizeof(void*) == 4, "the image has the layout of 32-bit ARM");

constexpr std::size_t kWord = 4;

[[noreturn]] void refuse(const char* what, std::size_t offset) {
  std::fprintf(stderr, "write_plan: byte %zu of the arena: %s\n", offset, what);
  std::exit(2);
}

}  // namespace

MemoryImage::MemoryImage(const Arena& first, const Arena& second) : first_(first), second_(second) {
  const auto same = [](const Block& a, const Block& b) {
    return a.offset == b.offset && a.bytes == b.bytes && a.align == b.align;
  };
  if (!std::ranges::equal(first.blocks(), second.blocks(), same)) {
    refuse("the two copies were not made alike", 0);
  }
  for (const Block& block : first.blocks()) {
    ImageBlock& of = blocks_.emplace_back();
    of.offset = block.offset;
    of.bytes = block.bytes;
    of.align = block.align;
  }
}

std::size_t MemoryImage::offset_of(const void* at) const {
  return static_cast<std::size_t>(static_cast<const std::byte*>(at) - first_.begin());
}

std::size_t MemoryImage::block_at(std::size_t offset) const {
  const auto after =
      std::ranges::upper_bound(blocks_, offset, std::ranges::less{}, &ImageBlock::offset);
  if (after == blocks_.begin()) refuse("a pointer to no block", offset);
  const auto block = after - 1;
  if (offset > block->offset + block->bytes) refuse("a pointer to no block", offset);
  return static_cast<std::size_t>(block - blocks_.begin());
}

std::uint32_t MemoryImage::word(const Arena& of, std::size_t offset) const {
  std::uint32_t value = 0;
  std::memcpy(&value, of.begin() + offset, kWord);
  return value;
}

void MemoryImage::add_root(const void* at, std::size_t bytes, std::size_t align, std::string name) {
  const std::size_t offset = offset_of(at);
  const auto after =
      std::ranges::upper_bound(blocks_, offset, std::ranges::less{}, &ImageBlock::offset);
  if (after == blocks_.begin()) refuse("a root in no block", offset);
  const auto whole = after - 1;
  const ImageBlock root{offset, bytes, align, std::move(name), false, false, false, 0};
  // The rest of the block that held it is never pointed to.
  if (offset < whole->offset + whole->bytes) whole->bytes = 0;
  if (whole->offset == offset) {
    *whole = root;
  } else {
    blocks_.insert(after, root);
  }
}

void MemoryImage::name_word(const void* at, std::string symbol) {
  named_words_[offset_of(at)] = std::move(symbol);
}

void MemoryImage::add_constant(const void* at, std::size_t bytes, std::string name) {
  constants_.push_back({static_cast<const std::byte*>(at), bytes, std::move(name)});
}

void MemoryImage::make_volume(const void* at, bool constant) {
  ImageBlock& block = blocks_[block_at(offset_of(at))];
  block.is_volume = true;
  block.is_constant = constant;
}

void MemoryImage::make_first(const void* at, const void* of) {
  ImageBlock& block = blocks_[block_at(offset_of(at))];
  const std::size_t other = block_at(offset_of(of));
  if (block.bytes > blocks_[other].bytes || std::memcmp(at, of, block.bytes) != 0) {
    refuse("two blocks that should be the same differ", block.offset);
  }
  block.first_of = other + 1;
}

std::size_t MemoryImage::pointed_at(std::size_t offset, std::size_t& into) const {
  const std::uint32_t a = word(first_, offset), b = word(second_, offset);
  const auto base_a = static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(first_.begin()));
  const auto base_b = static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(second_.begin()));
  if (a == b) return 0;
  if (b - a != base_b - base_a || a - base_a >= Arena::kBytes) {
    refuse("a word that is neither a number nor a pointer", offset);
  }
  const std::size_t block = block_at(a - base_a);
  into = (a - base_a) - blocks_[block].offset;
  return block + 1;
}

void MemoryImage::reach(const void* root, bool constant) {
  std::vector<std::size_t> next{block_at(offset_of(root))};
  blocks_[next[0]].wanted = true;
  blocks_[next[0]].is_constant = constant;
  const auto program_begin = reinterpret_cast<std::uintptr_t>(&__executable_start);
  const auto program_end = reinterpret_cast<std::uintptr_t>(&_end);
  while (!next.empty()) {
    const ImageBlock block = blocks_[next.back()];
    next.pop_back();
    if (block.first_of != 0) continue;
    if (block.bytes % kWord != 0) {
      const std::size_t tail = block.bytes / kWord * kWord;
      if (std::memcmp(first_.begin() + block.offset + tail, second_.begin() + block.offset + tail,
                      block.bytes - tail) != 0) {
        refuse("bytes that differ between two copies", block.offset + tail);
      }
    }
    for (std::size_t at = 0; at + kWord <= block.bytes; at += kWord) {
      const std::size_t offset = block.offset + at;
      if (named_words_.contains(offset)) continue;
      // Of plan and state alone: in an array, numbers may look like addresses.
      const std::uint32_t value = word(first_, offset);
      if (!block.name.empty() && value >= program_begin && value < program_end) {
        refuse(
            "a pointer into this program that has no name in the image; give it one in "
            "write_plan.cpp",
            at);
      }
      std::size_t into = 0;
      const std::size_t to = pointed_at(offset, into);
      if (to == 0 || blocks_[to - 1].wanted) continue;
      blocks_[to - 1].wanted = true;
      if (block.is_constant) blocks_[to - 1].is_constant = true;
      next.push_back(to - 1);
    }
  }
}

Room MemoryImage::room_of(const ImageBlock& block) const {
  if (block.first_of != 0) return Room::first;
  if (block.is_constant) return block.is_volume ? Room::field : Room::table;
  if (block.is_volume) return Room::volume;
  const std::byte* begin = first_.begin() + block.offset;
  const bool zero =
      std::all_of(begin, begin + block.bytes, [](std::byte b) { return b == std::byte{0}; });
  return zero ? Room::scratch : Room::state;
}

std::string MemoryImage::label_of(std::size_t index) const {
  const ImageBlock& block = blocks_[index];
  if (block.first_of != 0) return ".Lfirst" + std::to_string(block.first_of - 1);
  return block.name.empty() ? ".Lblock" + std::to_string(index) : block.name;
}

void MemoryImage::write_block(const ImageBlock& block, std::FILE* out) const {
  std::size_t zeros = 0;
  const auto flush = [&] {
    if (zeros != 0) std::fprintf(out, "\t.space %zu\n", zeros);
    zeros = 0;
  };
  std::size_t at = 0;
  for (; at + kWord <= block.bytes; at += kWord) {
    const std::size_t offset = block.offset + at;
    std::size_t into = 0;
    const auto named = named_words_.find(offset);
    const std::size_t to = named == named_words_.end() ? pointed_at(offset, into) : 0;
    if (named == named_words_.end() && to == 0 && word(first_, offset) == 0) {
      zeros += kWord;
      continue;
    }
    flush();
    if (named != named_words_.end()) {
      std::fprintf(out, "\t.word %s\n", named->second.c_str());
    } else if (to == 0) {
      std::fprintf(out, "\t.word 0x%x\n", static_cast<unsigned>(word(first_, offset)));
    } else {
      std::fprintf(out, "\t.word %s + %zu\n", label_of(to - 1).c_str(), into);
    }
  }
  flush();
  for (; at < block.bytes; ++at) {
    std::fprintf(out, "\t.byte 0x%x\n",
                 std::to_integer<unsigned>(first_.begin()[block.offset + at]));
  }
}

void MemoryImage::write(std::FILE* out) const {
  const auto each = [&](Room room, const char* section, const auto& content) {
    std::fprintf(out, "\t.section %s\n", section);
    for (std::size_t i = 0; i < blocks_.size(); ++i) {
      const ImageBlock& block = blocks_[i];
      if (!block.wanted || room_of(block) != room) continue;
      if (!block.name.empty()) std::fprintf(out, "\t.global %s\n", block.name.c_str());
      content(block, i);
    }
  };
  const auto filled = [&](const ImageBlock& block, std::size_t i) {
    std::fprintf(out, "\t.balign %zu\n%s:\n", block.align, label_of(i).c_str());
    write_block(block, out);
  };
  const auto empty = [&](const ImageBlock& block, std::size_t i) {
    std::fprintf(out, "\t.balign %zu\n%s:\n\t.space %zu\n", block.align, label_of(i).c_str(),
                 block.bytes);
  };
  each(Room::table, ".kerf_tables,\"a\",%progbits", filled);
  for (const Constant& constant : constants_) {
    std::fprintf(out, "\t.balign 8\n%s:\n", constant.name.c_str());
    for (std::size_t i = 0; i < constant.bytes; ++i) {
      std::fprintf(out, "\t.byte 0x%x\n", std::to_integer<unsigned>(constant.at[i]));
    }
  }
  std::fputs("\t.balign 4\n\t.global kerf_copies, kerf_copies_end\nkerf_copies:\n", out);
  each(Room::volume, ".kerf_tables", [&](const ImageBlock& block, std::size_t i) {
    std::fprintf(out, "\t.word %s, .Lfirst%zu, %zu\n", label_of(i).c_str(), i, block.bytes);
  });
  std::fputs("kerf_copies_end:\n", out);
  each(Room::state, ".kerf_state,\"aw\",%progbits", filled);
  each(Room::field, ".kerf_first,\"a\",%progbits", filled);
  each(Room::volume, ".kerf_first,\"a\",%progbits", [&](const ImageBlock& block, std::size_t i) {
    std::fprintf(out, "\t.balign %zu\n.Lfirst%zu:\n", std::max<std::size_t>(block.align, 4), i);
    write_block(block, out);
  });
  each(Room::volume, ".kerf_volume,\"aw\",%nobits", empty);
  each(Room::scratch, ".kerf_scratch,\"aw\",%nobits", empty);
}

}  // namespace kerf::bare
