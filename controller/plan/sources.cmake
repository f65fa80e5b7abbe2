# SPDX-License-Identifier: Apache-2.0
# Sources of this folder but for plan/cost: its own build takes them, and the golden run of another
# processor.
set(kerf_table_sources aligned_tool close_cells free_brick_map sample_tool tool_points tick_memory)
list(TRANSFORM kerf_table_sources REPLACE "(.+)" "${CMAKE_CURRENT_LIST_DIR}/tables/\\1.cpp")

set(kerf_plan_sources aligned_method any_pose covered_bound gather_method lattice method_memory
  methods splat_method stage_cost surface_method turned_box)
list(TRANSFORM kerf_plan_sources REPLACE "(.+)" "${CMAKE_CURRENT_LIST_DIR}/method/\\1.cpp")
list(APPEND kerf_plan_sources ${CMAKE_CURRENT_LIST_DIR}/compile.cpp)
