// SPDX-License-Identifier: Apache-2.0
#include "shared/posix/page_part.hpp"

#include "shared/posix/new_file.hpp"
#include "shared/text/file_text.hpp"

namespace kerf {

std::string with_part(std::string_view page, std::string_view name, std::string_view text) {
  const std::string begin = "<!-- begin " + std::string(name) + " -->\n";
  const std::string end = "<!-- end " + std::string(name) + " -->\n";
  const std::string part = begin + std::string(text) + end;
  const std::size_t first = page.find(begin);
  const std::size_t last = first == page.npos ? page.npos : page.find(end, first);
  if (last == page.npos) return std::string(page) + (page.empty() ? "" : "\n") + part;
  return std::string(page.substr(0, first)) + part + std::string(page.substr(last + end.size()));
}

void write_page_part(const std::filesystem::path& file, std::string_view name,
                     std::string_view text) {
  write_new_file(file, with_part(text_in(file), name, text));
}

}  // namespace kerf
