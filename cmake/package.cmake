# SPDX-License-Identifier: Apache-2.0
# Debian packages of what is installed: `./kerf package`, or `cmake --build build/release --target package`.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME kerf)
set(CPACK_PACKAGE_VENDOR kerf)
set(KERF_MAINTAINER "The authors of kerf <kerf@packages.invalid>" CACHE STRING
  "Name and address of who makes these packages, for their users' questions")
set(CPACK_PACKAGE_CONTACT "${KERF_MAINTAINER}")
# Homepage of the packages: the repository of this clone, unless given.
find_package(Git QUIET)
if(GIT_FOUND)
  execute_process(COMMAND ${GIT_EXECUTABLE} -C ${PROJECT_SOURCE_DIR} remote get-url origin
    OUTPUT_VARIABLE origin OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
endif()
if(NOT origin MATCHES "^https?://[^@]*$")
  set(origin "")
endif()
set(KERF_HOMEPAGE "${origin}" CACHE STRING "Where users of these packages report: the repository or its issue tracker")
set(CPACK_PACKAGE_HOMEPAGE_URL "${KERF_HOMEPAGE}")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "haptic milling of a tooth")
set(CPACK_COMPONENT_KERF_DESCRIPTION "A deterministic haptic controller lets a dental bur cut a tooth of voxels, or
any CT. It has its pictures, a recorder, a bridge to browsers and to a second
machine, and an emulator of the device, so that no hardware is needed.")
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION "Headers and static libraries of kerf, for programs of one's own.
A project finds them by find_package(kerf); with them come the sources of its
main programs, for laws of force that are linked into them.")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_THREADS 0)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL kerf development)
set(CPACK_DEBIAN_KERF_PACKAGE_NAME kerf)
set(CPACK_DEBIAN_KERF_PACKAGE_SHLIBDEPS ON)
# What is no linked library: OpenGL is loaded at run time, and demo/ is Python. apt installs what is recommended, too, so that what
# only some need is suggested: plots (forces.svg), videos, rights to devices, completion, certificates for kerf bridge.
set(CPACK_DEBIAN_KERF_PACKAGE_DEPENDS "libegl1, libgl1, libgl1-mesa-dri, python3")
set(CPACK_DEBIAN_KERF_PACKAGE_SUGGESTS "python3-matplotlib, ffmpeg, udev, bash-completion, openssl")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME kerf-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS
  "kerf (= ${PROJECT_VERSION}), cmake, g++, pkgconf, libgdcm-dev, libpng-dev, libtiff-dev, zlib1g-dev, libarchive-dev, libexpat1-dev, liblz4-dev, libusb-1.0-0-dev, libhidapi-dev, libseccomp-dev")
set(pairs kerf:kerf development:kerf-dev)
if(TARGET kerf_python)
  list(APPEND CPACK_COMPONENTS_ALL python)
  list(APPEND pairs python:python3-kerf)
  set(CPACK_COMPONENT_PYTHON_DESCRIPTION "kerf's servo, its emulated devices and hands, its recordings and its
stability maps as a module for Python, import kerf, with arrays of NumPy.")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-kerf)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SHLIBDEPS ON)
  # The module is of one Python.
  math(EXPR next "${Python3_VERSION_MINOR} + 1")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "kerf (= ${PROJECT_VERSION}), python3 (>= ${Python3_VERSION_MAJOR}.${Python3_VERSION_MINOR}), python3 (<< ${Python3_VERSION_MAJOR}.${next}), python3-numpy")
endif()
# The changelog of a package in Debian's form, which leads to the one for users.
string(TIMESTAMP day "%a, %d %b %Y %H:%M:%S +0000" UTC)
foreach(pair ${pairs})
  string(REPLACE ":" ";" pair ${pair})
  list(GET pair 0 component)
  list(GET pair 1 package)
  file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/changelog/${package} CONTENT
"kerf (${PROJECT_VERSION}) unstable; urgency=medium

  * What users notice: /usr/share/doc/kerf/CHANGELOG.md

 -- ${KERF_MAINTAINER}  ${day}
")
  set(to "${CMAKE_INSTALL_DATADIR}/doc/${package}")
  install(FILES ${PROJECT_BINARY_DIR}/changelog/${package} DESTINATION ${to} RENAME changelog COMPONENT ${component})
  install(CODE "execute_process(COMMAND gzip -9nf \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${to}/changelog\"
    COMMAND_ERROR_IS_FATAL ANY)" COMPONENT ${component})
endforeach()
include(CPack)
