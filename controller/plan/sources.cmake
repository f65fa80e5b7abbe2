# SPDX-License-Identifier: Apache-2.0
# Sources of this folder but for plan/cost: its own build takes them, and the golden run of another
# processor.
set(kerf_table_sources aligned_tool close_cells free_brick_map sample_tool tool_points tick_memory)
list(TRANSFORM kerf_table_sources REPLACE "(.+)" "${CMAKE_CURRENT_LIST_DIR}/tables/\\1.cpp")

file(GLOB kerf_plan_sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_LIST_DIR}/method/*.cpp)
list(APPEND kerf_plan_sources ${CMAKE_CURRENT_LIST_DIR}/compile.cpp)
