# SPDX-License-Identifier: Apache-2.0
# `cmake --install`: programs, and what a project of one's own needs to build programs with laws of its
# own (docs/own-law.md): headers, static libraries, find_package(kerf).
include(CMakePackageConfigHelpers)
include(GNUInstallDirs)

# kerf_libraries(out folder): the libraries that are built in a folder and below.
function(kerf_libraries out folder)
  get_property(targets DIRECTORY ${folder} PROPERTY BUILDSYSTEM_TARGETS)
  set(found "")
  foreach(target ${targets})
    get_target_property(type ${target} TYPE)
    if(type MATCHES "^(STATIC|INTERFACE)_LIBRARY$")
      list(APPEND found ${target})
    endif()
  endforeach()
  get_property(below DIRECTORY ${folder} PROPERTY SUBDIRECTORIES)
  foreach(part ${below})
    kerf_libraries(more ${part})
    list(APPEND found ${more})
  endforeach()
  set(${out} ${found} PARENT_SCOPE)
endfunction()

set(libraries kerf_options)
foreach(part shared controller record hil lab)
  kerf_libraries(more ${PROJECT_SOURCE_DIR}/${part})
  list(APPEND libraries ${more})
endforeach()
foreach(library ${libraries})  # kerf_law is kerf::law
  string(REGEX REPLACE "^kerf_" "" name ${library})
  set_target_properties(${library} PROPERTIES EXPORT_NAME ${name})
endforeach()

set(package ${CMAKE_INSTALL_LIBDIR}/cmake/kerf)
set(headers ${CMAKE_INSTALL_INCLUDEDIR}/kerf)
install(TARGETS ${libraries} EXPORT kerf
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}/kerf INCLUDES DESTINATION ${headers})
install(EXPORT kerf NAMESPACE kerf:: DESTINATION ${package} FILE kerf-targets.cmake)
install(TARGETS kerf-controller kerf-emulator kerf-lab kerf-record kerf-recorder kerf-volume)
install(DIRECTORY shared controller record hil lab DESTINATION ${headers}
  FILES_MATCHING PATTERN *.hpp)
# What each program compiles for itself: a main, and the allocator that counts.
install(FILES controller/main.cpp DESTINATION ${CMAKE_INSTALL_DATADIR}/kerf/controller)
install(FILES lab/main.cpp DESTINATION ${CMAKE_INSTALL_DATADIR}/kerf/lab)
install(FILES controller/shell/allocation_counter.cpp DESTINATION ${CMAKE_INSTALL_DATADIR}/kerf)
install(DIRECTORY scenes DESTINATION ${CMAKE_INSTALL_DATADIR}/kerf)

foreach(port usb hid)  # what these need, the project needs, too
  set(kerf_has_${port} OFF)
  if(TARGET kerf_${port})
    set(kerf_has_${port} ON)
  endif()
endforeach()
configure_package_config_file(cmake/kerf-config.cmake.in ${PROJECT_BINARY_DIR}/kerf-config.cmake
  INSTALL_DESTINATION ${package} PATH_VARS CMAKE_INSTALL_DATADIR)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/kerf-config-version.cmake
  COMPATIBILITY ExactVersion)
install(FILES ${PROJECT_BINARY_DIR}/kerf-config.cmake ${PROJECT_BINARY_DIR}/kerf-config-version.cmake
  DESTINATION ${package})
