# SPDX-License-Identifier: Apache-2.0
# Debian packages of what is installed: `./kerf package`, or `cmake --build build/release --target package`.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME kerf)
set(CPACK_PACKAGE_VENDOR kerf)
set(CPACK_PACKAGE_CONTACT "The authors of kerf <kerf@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "feel, mill and see a tooth")
set(CPACK_PACKAGE_DESCRIPTION "A deterministic haptic controller that lets a dental bur cut a tooth of voxels, with its
pictures and an emulator of the device, so that no hardware is needed.")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_THREADS 0)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_COMPRESSION_TYPE zstd)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL kerf development)
set(CPACK_DEBIAN_KERF_PACKAGE_NAME kerf)
set(CPACK_DEBIAN_KERF_PACKAGE_SHLIBDEPS ON)
# What is no linked library: OpenGL is looked for at run time, lab/report draws forces.svg, and demo/ calls umount.
set(CPACK_DEBIAN_KERF_PACKAGE_DEPENDS "libegl1, libgl1, libgl1-mesa-dri, python3-matplotlib, mount")
set(CPACK_DEBIAN_KERF_PACKAGE_RECOMMENDS "udev, bash-completion, openssl")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME kerf-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS
  "kerf (= ${PROJECT_VERSION}), cmake, g++, pkg-config, libgdcm-dev, libpng-dev, libtiff-dev, zlib1g-dev, libarchive-dev, libexpat1-dev, libusb-1.0-0-dev, libhidapi-dev, libseccomp-dev")
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION "Headers and static libraries of kerf: find_package(kerf).")
include(CPack)
