# SPDX-License-Identifier: Apache-2.0
# What C++ fixes and the page must know, as a module of JavaScript: fields of records, codes, and
# constants of the picture, each out of the file that defines it. Ends the build where one is gone.
# cmake -DOUTPUT=FILE -DROOT=FOLDER -P constants.cmake
cmake_minimum_required(VERSION 3.25)
set(text "// Generated from C++ by constants.cmake; edit that.
const magic = text => [...text].reduceRight((value, c) => value * 256 + c.charCodeAt(0), 0);
")

# Sets `value` to what `pattern` has in brackets, and C++'s forms of numbers become JavaScript's.
function(take file pattern what)
  file(READ ${ROOT}/${file} source)
  if(NOT source MATCHES "${pattern}")
    message(FATAL_ERROR "constants.cmake: ${file} has no ${what}; name the file that has it")
  endif()
  string(REGEX REPLACE "//[^\n]*" "" value "${CMAKE_MATCH_1}")
  string(REGEX REPLACE "([0-9])[UF]" "\\1" value "${value}")
  string(REPLACE "std::numbers::pi" "Math.PI" value "${value}")
  set(value "${value}" PARENT_SCOPE)
endfunction()

macro(constants file)
  foreach(name ${ARGN})
    take(${file} "[^a-zA-Z_]${name} =[ \n]+([^;]+);" ${name})
    string(APPEND text "export const ${name} = ${value};\n")
  endforeach()
endmacro()

# Of a name and a list in braces.
macro(list_constant file name pattern)
  take(${file} "${pattern}{([^}]*)}" ${name})
  string(APPEND text "export const ${name} = [${value}];\n")
endmacro()

macro(enumeration file name)
  take(${file} "enum class ${name} : [a-z0-9_:]+ {([^}]*)}" "enum ${name}")
  string(REPLACE "=" ":" value "${value}")
  string(APPEND text "export const ${name} = {${value}};\n")
endmacro()

# code: [name, meaning]
macro(codes file name pattern)
  take(${file} "${pattern}\\[\\] = {([^;]*)}" ${name})
  string(REGEX REPLACE "{([0-9]+), " "\\1: [" value "${value}")
  string(REPLACE "}" "]" value "${value}")
  string(APPEND text "export const ${name} = {${value}};\n")
endmacro()

macro(record name file)
  take(${file} "(${name}, [^\n]*.*KERF_FIELD\\(${name}, [^\n]*)" "record ${name}")
  string(REGEX MATCHALL "${name}, [a-z_0-9]+, [0-9a-fx]+, \"[a-z0-9]+\", [0-9]+" fields "${value}")
  set(rows "")
  foreach(field ${fields})
    string(REGEX REPLACE "^${name}, ([a-z_0-9]+), (.*)" "    ['\\1', \\2],\n" row ${field})
    string(APPEND rows "${row}")
  endforeach()
  take(shared/segment/layout_table.hpp "layout_matches\\(\"${name}\", ([0-9]+)\\)" "size of ${name}")
  string(APPEND text "  ${name}: {bytes: ${value}, fields: [\n${rows}  ]},\n")
endmacro()

string(APPEND text "/** Name, offset, type and count of each field. */\nexport const records = {\n")
record(VolumeDescriptor shared/segment/layout_table.hpp)
record(TickRecord shared/segment/tick_table.hpp)
record(DirtyRecord shared/segment/layout_table.hpp)
string(APPEND text "};\n")

constants(bridge/wire/messages.hpp kProtocol kMaxRawBytes kHelloMagic kFrameMagic kRecordsMagic kReplyMagic
  kAckMagic kCommandMagic kViewMagic kMayCommand kTwoArms kPacked kLastOfPass kRunEnded)
enumeration(bridge/wire/messages.hpp CloseCode)
constants(include/kerf/tick.hpp kFlagContact kFlagDeviceFault kFlagForbidden kFlagRefused kFlagShaft)
enumeration(shared/segment/layout.hpp Lifecycle)
enumeration(shared/segment/command.hpp CommandKind)
enumeration(shared/segment/command.hpp ReplyStatus)
codes(shared/segment/tick_table.hpp kFaults kTickFaults)
codes(shared/segment/tick_table.hpp kPhases kTickPhases)

constants(visualizer/scene/camera.cpp kHalfHeightRad kHomeYawRad kHomePitchRad kMaxPitchRad kZoomStep
  kMargin kNearest kFarthest kNearPlane)
constants(visualizer/scene/camera.hpp kEyesPerConvergence)
constants(visualizer/scene/appearance.hpp kPaletteWidth kLeastOpacity kOpacityMm)
constants(visualizer/scene/appearance.cpp kEmptyShare kBorderEdges kHighestAir kWholeSoftest kHalfBand
  kHardestOpacity kSoftestOpacity)
list_constant(visualizer/scene/appearance.cpp kIvory "kIvory")
constants(visualizer/render/volume_textures.cpp kMaterialReach)
constants(visualizer/scene/gradient_plan.hpp kMiddle)
constants(visualizer/scene/gradient_plan.cpp kNarrowPerLongest kWidePerShortest kWidePerLongest kCubic kMostInCell)
constants(visualizer/scene/gradient_plan.hpp kSurfaceSlope)
list_constant(visualizer/scene/gradient_plan.cpp kFaridSmooth "kFaridSmooth..")
list_constant(visualizer/scene/gradient_plan.cpp kFaridSlope "kFaridSlope..")
list_constant(visualizer/scene/gradient_plan.cpp kWideSmooth "kWideSmooth..")
list_constant(visualizer/scene/gradient_plan.cpp kWideSlope "kWideSlope..")
constants(visualizer/scene/filter_kernels.hpp kAdaptedAgree kAdaptedDiffer)
constants(visualizer/cast/cast_kernels.hpp kClearVox kMostTapVox)
list_constant(visualizer/cast/cast_kernels.hpp kOcclusionTapsMm "kOcclusionTapsMm.kOcclusionTaps. = ")
take(visualizer/render/translucent_renderers.hpp "step_vox = ([^;]+);" "step of blend")
string(APPEND text "export const kBlendStepVox = ${value};\n")
constants(visualizer/compose/tool_painter.cpp kSides kCreaseDegrees kNeckPerRadius kShankPerRadius kNeckRadii
  kShankFromRadii kShankToRadii)
constants(visualizer/compose/tool_painter.cpp kHeadLength kHeadRadius kHeadBare kFaint)
constants(visualizer/compose/tool_painter.cpp kArrowScalesPerN kArrowThickness kLeastArrowN)
list_constant(visualizer/compose/tool_painter.cpp kSteel "kSteel{.colour = ")
list_constant(visualizer/compose/tool_painter.cpp kForce "kForce{.colour = ")
constants(visualizer/picture/picture.cpp kStaleMs kToolRoom)
constants(visualizer/panels/overlay.hpp kSpanS)
constants(visualizer/panels/figure_panels.cpp kLeastFullForceN kLeastFullDepthMm)
take(visualizer/panels/overlay.hpp "full_force_n = ([^;]+);" "full force")
string(APPEND text "export const kFullForceN = ${value};\n")
take(visualizer/panels/control_panels.cpp "SliderFloat\\(\"iso\", &iso, ([^\"]+), \"" "range of iso")
string(APPEND text "export const kIsoRange = [${value}];\n")
take(visualizer/panels/control_panels.cpp "&value, ([^\"]+), \"%.3f\"" "range of an opacity")
string(APPEND text "export const kOpacityRange = [${value}];\n")
constants(visualizer/app/hand_control.hpp kWheelMm kPressMm kMostAheadMm)
file(WRITE ${OUTPUT} "${text}")
