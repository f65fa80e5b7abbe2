# SPDX-License-Identifier: Apache-2.0
# Volumes: reading, windowing, cropping, resampling, the phantom.

# Debian's GDCM package names tools that it does not bring, and says so at length.
set(CMAKE_MESSAGE_LOG_LEVEL WARNING)
find_package(ITK REQUIRED COMPONENTS ITKIONRRD ITKIOMeta ITKIONIFTI ITKIOGDCM)
unset(CMAKE_MESSAGE_LOG_LEVEL)
find_package(ZLIB REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(CLI11 REQUIRED)

add_library(kerf_volume STATIC
  library_messages.cpp phantom.cpp phantom_shape.cpp volume_crop.cpp volume_density.cpp
  volume_header.cpp volume_io.cpp volume_limits.cpp volume_nifti.cpp volume_resample.cpp
  volume_slices.cpp volume_source.cpp volume_write.cpp)
# SYSTEM: ITK's headers do not pass our warnings; only volume_io.cpp includes them.
target_include_directories(kerf_volume SYSTEM PRIVATE ${ITK_INCLUDE_DIRS})
target_link_libraries(kerf_volume PUBLIC kerf_shared kerf_posix PRIVATE ${ITK_LIBRARIES} ZLIB::ZLIB)
kerf_computes(kerf_volume)

add_library(kerf_volume_tool STATIC
  ../volume_tool/volume_commands.cpp ../volume_tool/volume_info.cpp)
target_link_libraries(kerf_volume_tool
  PUBLIC kerf_volume PRIVATE CLI11::CLI11 nlohmann_json::nlohmann_json)

add_executable(kerf-volume ../volume_tool/main.cpp)
target_link_libraries(kerf-volume PRIVATE kerf_volume_tool)
