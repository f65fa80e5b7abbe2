# SPDX-License-Identifier: Apache-2.0
# `cmake --install`, in two components. kerf: programs, ./kerf itself as `kerf`, what they need, man pages,
# completion, docs. development: what a project of one's own needs to build upon kerf (docs/packages.md):
# headers, static libraries, find_package(kerf).
include(CMakePackageConfigHelpers)
include(GNUInstallDirs)
set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME kerf)

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
foreach(part shared controller record replay hil lab)
  kerf_libraries(more ${PROJECT_SOURCE_DIR}/${part})
  list(APPEND libraries ${more})
endforeach()
foreach(library ${libraries})  # kerf_law is kerf::law
  string(REGEX REPLACE "^kerf_" "" name ${library})
  set_target_properties(${library} PROPERTIES EXPORT_NAME ${name})
endforeach()

set(programs kerf-arm kerf-controller kerf-emulator kerf-lab kerf-record kerf-recorder kerf-replay kerf-volume)
foreach(program kerf-bridge kerf-visualizer)  # where their libraries are there
  if(TARGET ${program})
    list(APPEND programs ${program})
  endif()
endforeach()
install(TARGETS ${programs})

# Their man pages and completion, from their own command lines, and those of ./kerf.
set(pages ${PROJECT_BINARY_DIR}/man)
set(completion ${PROJECT_BINARY_DIR}/completion)
file(MAKE_DIRECTORY ${pages} ${completion})
foreach(program ${programs})
  add_custom_command(OUTPUT ${pages}/${program}.1 ${completion}/${program}
    COMMAND ${program} --man > ${pages}/${program}.1
    COMMAND ${program} --completion > ${completion}/${program}
    DEPENDS ${program} VERBATIM)
  list(APPEND manuals ${pages}/${program}.1 ${completion}/${program})
endforeach()
file(GLOB help CONFIGURE_DEPENDS cli/help/*.txt)
add_custom_command(OUTPUT ${pages}/kerf.1 ${completion}/kerf
  COMMAND cmake/kerf-manual.sh ${PROJECT_VERSION} > ${pages}/kerf.1
  COMMAND cmake -E copy cli/completion.sh ${completion}/kerf
  WORKING_DIRECTORY ${PROJECT_SOURCE_DIR}
  DEPENDS ${PROJECT_SOURCE_DIR}/kerf ${PROJECT_SOURCE_DIR}/cmake/kerf-manual.sh ${PROJECT_SOURCE_DIR}/cli/help.sh
    ${PROJECT_SOURCE_DIR}/cli/completion.sh ${help} VERBATIM)
add_custom_target(manuals ALL DEPENDS ${manuals} ${pages}/kerf.1)
install(DIRECTORY ${pages}/ DESTINATION ${CMAKE_INSTALL_MANDIR}/man1)
# As Debian's policy has it (12.1, 12.7).
install(CODE "file(GLOB pages \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_MANDIR}/man1/kerf*.1\")
execute_process(COMMAND gzip -9nf \${pages} COMMAND_ERROR_IS_FATAL ANY)")
install(DIRECTORY ${completion}/ DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions)

# ./kerf looks for all else beside itself, and finds that it is installed.
set(share ${CMAKE_INSTALL_DATADIR}/kerf)
install(PROGRAMS kerf DESTINATION ${share})
install(DIRECTORY cli DESTINATION ${share})
install(DIRECTORY demo DESTINATION ${share} PATTERN __pycache__ EXCLUDE)
install(PROGRAMS .ci/doctor.sh DESTINATION ${share}/.ci)
install(CODE "file(CREATE_LINK ../${share}/kerf
  \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_BINDIR}/kerf\" SYMBOLIC)")
install(DIRECTORY scenes DESTINATION ${share} PATTERN "ct.*" EXCLUDE PATTERN .gitignore EXCLUDE)  # who has a CT keeps it
install(DIRECTORY ros DESTINATION ${share})  # for a workspace of ROS 2
install(DIRECTORY hil/faults DESTINATION ${share}/hil)
install(DIRECTORY lab/report DESTINATION ${share}/lab PATTERN __pycache__ EXCLUDE)
install(DIRECTORY docs/ DESTINATION ${CMAKE_INSTALL_DOCDIR} PATTERN .site EXCLUDE)  # the make of the site
install(FILES CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(FILES cmake/copyright DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(FILES controller/device/60-kerf.rules DESTINATION lib/udev/rules.d)
install(FILES controller/device/invalid.kerf.kerf.metainfo.xml DESTINATION ${CMAKE_INSTALL_DATADIR}/metainfo)
install(DIRECTORY examples python DESTINATION ${CMAKE_INSTALL_DOCDIR}
  PATTERN __pycache__ EXCLUDE)

set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME development)
install(FILES cmake/copyright DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/kerf-dev)
set(package ${CMAKE_INSTALL_LIBDIR}/cmake/kerf)
set(headers ${CMAKE_INSTALL_INCLUDEDIR}/kerf)
install(TARGETS ${libraries} EXPORT kerf
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}/kerf INCLUDES DESTINATION ${headers})
install(EXPORT kerf NAMESPACE kerf:: DESTINATION ${package} FILE kerf-targets.cmake)
install(DIRECTORY shared controller record replay hil lab DESTINATION ${headers}
  FILES_MATCHING PATTERN *.hpp)
# What each program compiles for itself: a main, and the allocator that counts.
foreach(program controller lab replay)
  install(FILES ${program}/main.cpp DESTINATION ${CMAKE_INSTALL_DATADIR}/kerf/${program})
endforeach()
install(FILES controller/loop/allocation_counter.cpp DESTINATION ${CMAKE_INSTALL_DATADIR}/kerf)

foreach(port usb hid)  # what these need, the project needs, too
  set(kerf_has_${port} OFF)
  if(TARGET kerf_${port})
    set(kerf_has_${port} ON)
  endif()
endforeach()
configure_package_config_file(cmake/kerf-config.cmake.in ${PROJECT_BINARY_DIR}/kerf-config.cmake
  INSTALL_DESTINATION ${package} PATH_VARS CMAKE_INSTALL_DATADIR CMAKE_INSTALL_BINDIR)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/kerf-config-version.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/kerf-config.cmake ${PROJECT_BINARY_DIR}/kerf-config-version.cmake
  DESTINATION ${package})
include(cmake/package.cmake)
