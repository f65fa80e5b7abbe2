# SPDX-License-Identifier: Apache-2.0
# Toolchain: clang, in the version that cmake/clang-version.sh finds.
execute_process(COMMAND ${CMAKE_CURRENT_LIST_DIR}/clang-version.sh OUTPUT_VARIABLE KERF_CLANG_VERSION
  OUTPUT_STRIP_TRAILING_WHITESPACE)
set(CMAKE_C_COMPILER clang-${KERF_CLANG_VERSION})
set(CMAKE_CXX_COMPILER clang++-${KERF_CLANG_VERSION})
