# SPDX-License-Identifier: Apache-2.0
# `cmake --install`, in two components. kerf: programs, ./kerf itself as `kerf`, what they need, man pages,
# completion, docs. development: what a project of one's own needs to build upon kerf (docs/compatibility.md):
# include/kerf, libkerf, find_package(kerf).
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

# libkerf: the objects of all libraries that include/kerf stands before, and the libraries of others that they need.
set(objects "")
set(others "")
foreach(part shared arm/inverse3 controller record replay hil lab face)
  kerf_libraries(libraries ${PROJECT_SOURCE_DIR}/${part})
  foreach(library ${libraries})
    get_target_property(type ${library} TYPE)
    if(type STREQUAL "STATIC_LIBRARY")
      list(APPEND objects $<TARGET_OBJECTS:${library}>)
    endif()
    foreach(property LINK_LIBRARIES INTERFACE_LINK_LIBRARIES)
      get_target_property(needed ${library} ${property})
      if(needed)
        list(APPEND others ${needed})
      endif()
    endforeach()
  endforeach()
endforeach()
list(FILTER others EXCLUDE REGEX "kerf_|LINK_ONLY|BUILD_INTERFACE")
list(REMOVE_DUPLICATES others)
add_library(kerf STATIC ${objects} $<TARGET_OBJECTS:kerf_allocation_counter>)
set_target_properties(kerf PROPERTIES LINKER_LANGUAGE CXX)
target_compile_features(kerf INTERFACE cxx_std_20)
target_include_directories(kerf INTERFACE $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include> $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>)
target_compile_options(kerf INTERFACE -ffp-contract=off)  # a fused multiply-add changes bits between machines
target_link_libraries(kerf INTERFACE ${others})
set(main_objects "")
foreach(program controller lab replay)  # for programs with laws of one's own
  add_library(kerf_main_${program} OBJECT ${program}/main.cpp)
  target_link_libraries(kerf_main_${program} PRIVATE $<BUILD_INTERFACE:kerf_${program}>)
  set_target_properties(kerf_main_${program} PROPERTIES EXPORT_NAME main_${program})
  list(APPEND main_objects kerf_main_${program})
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
install(DIRECTORY cli DESTINATION ${share} PATTERN kerf-studies.txt EXCLUDE PATTERN kerf-visualizer-monkey.txt EXCLUDE)
install(DIRECTORY demo identify DESTINATION ${share} PATTERN __pycache__ EXCLUDE)
install(PROGRAMS .ci/doctor.sh DESTINATION ${share}/.ci)
install(CODE "file(CREATE_LINK ../${share}/kerf
  \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_BINDIR}/kerf\" SYMBOLIC)")
install(DIRECTORY scenes DESTINATION ${share} PATTERN "ct.*" EXCLUDE PATTERN .gitignore EXCLUDE)  # who has a CT keeps it
install(DIRECTORY ros DESTINATION ${share})  # for a workspace of ROS 2
install(DIRECTORY hil/faults DESTINATION ${share}/hil)
# Pages of kerf-studies are made in a clone.
install(DIRECTORY lab/report DESTINATION ${share}/lab PATTERN __pycache__ EXCLUDE
  PATTERN contact.py EXCLUDE PATTERN burs.py EXCLUDE)
install(DIRECTORY docs/ DESTINATION ${CMAKE_INSTALL_DOCDIR} PATTERN .site EXCLUDE)  # the make of the site
install(FILES CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(FILES cmake/copyright DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(FILES controller/device/60-kerf.rules DESTINATION lib/udev/rules.d)
install(FILES controller/device/invalid.kerf.kerf.metainfo.xml DESTINATION ${CMAKE_INSTALL_DATADIR}/metainfo)
install(DIRECTORY examples python DESTINATION ${CMAKE_INSTALL_DOCDIR}
  PATTERN __pycache__ EXCLUDE PATTERN python/module EXCLUDE PATTERN python/kerf EXCLUDE PATTERN python/CMakeLists.txt EXCLUDE)

if(TARGET kerf_python)  # import kerf, beside the scenes, for Debian's Python
  set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME python)
  set(packages lib/python3/dist-packages)
  install(TARGETS kerf_python DESTINATION ${packages}/kerf)
  install(DIRECTORY python/kerf python/kerf_reader DESTINATION ${packages} FILES_MATCHING PATTERN *.py PATTERN __pycache__ EXCLUDE)
  install(FILES cmake/copyright DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/python3-kerf)
endif()

set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME development)
install(FILES cmake/copyright DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/kerf-dev)
set(package ${CMAKE_INSTALL_LIBDIR}/cmake/kerf)
set(headers ${CMAKE_INSTALL_INCLUDEDIR}/kerf)
install(TARGETS kerf ${main_objects} EXPORT kerf
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} OBJECTS DESTINATION ${CMAKE_INSTALL_LIBDIR}/kerf
  INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} ${headers}/private)
install(EXPORT kerf NAMESPACE kerf:: DESTINATION ${package} FILE kerf-targets.cmake)
install(DIRECTORY include/kerf/ DESTINATION ${headers})
# What kerf/law.hpp needs, since a law is a template: no interface.
foreach(header controller/law/law.hpp controller/law/virtual_coupling.hpp controller/law/registry/law_registry.hpp
    shared/numeric/numbers.hpp shared/numeric/vec.hpp)
  get_filename_component(folder ${header} DIRECTORY)
  install(FILES ${header} DESTINATION ${headers}/private/${folder})
endforeach()

foreach(port usb hid)  # what these need, the project needs, too
  set(kerf_has_${port} OFF)
  if(TARGET kerf_${port})
    set(kerf_has_${port} ON)
  endif()
endforeach()
configure_package_config_file(cmake/kerf-config.cmake.in ${PROJECT_BINARY_DIR}/kerf-config.cmake
  INSTALL_DESTINATION ${package} PATH_VARS CMAKE_INSTALL_DATADIR CMAKE_INSTALL_BINDIR)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/kerf-config-version.cmake
  COMPATIBILITY SameMajorVersion)
install(FILES ${PROJECT_BINARY_DIR}/kerf-config.cmake ${PROJECT_BINARY_DIR}/kerf-config-version.cmake
  DESTINATION ${package})
include(cmake/package.cmake)

# What is installed, and the stand-ins of a clone: all that ./kerf setup builds.
add_custom_target(products)
add_dependencies(products ${programs} manuals kerf ${main_objects} stand-in)
