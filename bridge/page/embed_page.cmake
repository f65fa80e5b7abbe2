# SPDX-License-Identifier: Apache-2.0
# Writes the files of the page as raw string literals, so that the bridge runs from anywhere. Of a script, comments that have
# lines of their own are left out but for the first, the licence, and so are spaces that begin a line: a sixth of what a browser waits for.
# cmake -DOUTPUT=FILE -DFILES=a.js,b.css -P embed_page.cmake
cmake_minimum_required(VERSION 3.25)
set(type_html "text/html; charset=utf-8")
set(type_css "text/css; charset=utf-8")
set(type_js "text/javascript; charset=utf-8")
set(type_svg "image/svg+xml")
string(REPLACE "," ";" FILES "${FILES}")
set(entries "")
foreach(path ${FILES})
  get_filename_component(name ${path} NAME)
  string(REGEX REPLACE ".*\\." "" ending ${name})
  file(READ ${path} text)
  if(ending STREQUAL "js")
    string(REGEX REPLACE "\n *//[^\n]*" "" text "${text}")
    string(REGEX REPLACE "\n */\\*\\*([^*]|\\*+[^*/])*\\*+/ *\n" "\n" text "${text}")
    string(REGEX REPLACE "\n +" "\n" text "${text}")
  endif()
  string(APPEND entries "    PageFile{\"${name}\", \"${type_${ending}}\", R\"PAGE(${text})PAGE\"},\n")
endforeach()
file(WRITE ${OUTPUT} "// Generated from bridge/page/web/ and shaders/; edit those.
#include <array>

#include \"bridge/page/page_files.hpp\"

namespace kerf::bridge {

std::span<const PageFile> page_files() noexcept {
  static constexpr auto kFiles = std::to_array<PageFile>({
${entries}  });
  return kFiles;
}

}  // namespace kerf::bridge
")
