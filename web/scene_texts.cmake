# SPDX-License-Identifier: Apache-2.0
# The scenes and hands of web/page/scenes.js as a module of JavaScript. cmake -DOUTPUT=FILE -DROOT=FOLDER -P scene_texts.cmake
cmake_minimum_required(VERSION 3.25)
file(READ ${ROOT}/web/page/scenes.js list)
string(REGEX MATCHALL "name: '[a-z0-9_]+', hand: '[a-z0-9_]+'" scenes "${list}")
set(paths "")
foreach(scene ${scenes})
  string(REGEX REPLACE "name: '(.*)', hand: '(.*)'" "scenes/\\1.toml;scenes/hands/\\2.toml" files "${scene}")
  list(APPEND paths ${files})
endforeach()
list(REMOVE_DUPLICATES paths)
set(entries "")
foreach(path ${paths})
  file(READ ${ROOT}/${path} text)
  string(REPLACE "\\" "\\\\" text "${text}")
  string(REPLACE "`" "\\`" text "${text}")
  string(REPLACE "\${" "\\\${" text "${text}")
  string(APPEND entries "  '${path}': `${text}`,\n")
endforeach()
file(WRITE ${OUTPUT} "// Generated from scenes/; edit those.
/** By path. */
export const texts = {
${entries}};
")
