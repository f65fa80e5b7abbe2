# SPDX-License-Identifier: Apache-2.0
# The sources of this folder that the core-only build takes too.
set(kerf_table_sources free_brick_map point_shell_table sample_tables)
list(TRANSFORM kerf_table_sources REPLACE "(.+)" "${CMAKE_CURRENT_LIST_DIR}/tables/\\1.cpp")

file(GLOB kerf_plan_sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_LIST_DIR}/method/*.cpp)
list(APPEND kerf_plan_sources ${CMAKE_CURRENT_LIST_DIR}/compile.cpp)
