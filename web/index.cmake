# SPDX-License-Identifier: Apache-2.0
# The bridge's index.html, begun by servo.js and try.js, with what these need asked for at once, in the order in which it is needed.
# cmake -DOUTPUT=FILE -DPAGE=FILE -DMODULES=FOLDER -P index.cmake     MODULES: all that the page imports, generated ones too
cmake_minimum_required(VERSION 3.25)
file(READ ${PAGE} text)
set(begins "<script type=\"module\" src=\"kerf.js\"></script>")
string(FIND "${text}" "${begins}" at)
if(at EQUAL -1)
  message(FATAL_ERROR "index.cmake: ${PAGE} has no ${begins}; name what begins the page")
endif()
# Breadth first: the imports of a module stand behind it. A worker fetches its own.
set(modules servo.js try.js)
set(links "")
set(at 0)
while(TRUE)
  list(LENGTH modules count)
  if(at EQUAL count)
    break()
  endif()
  list(GET modules ${at} module)
  math(EXPR at "${at} + 1")
  file(READ ${MODULES}/${module} source)
  string(REGEX MATCHALL "(from |import\\()'\\./[a-z_]+\\.js'" imports "${source}")
  list(TRANSFORM imports REPLACE ".*'\\./(.*)'" "\\1")
  list(APPEND modules ${imports})
  list(REMOVE_DUPLICATES modules)
  if(NOT module MATCHES "^(servo|try)\\.js$")
    string(APPEND links "\n<link rel=\"modulepreload\" href=\"${module}\">")
  endif()
endwhile()
string(REGEX REPLACE "\n<link rel=\"modulepreload\" href=\"[a-z_]+\\.js\">" "" text "${text}")
string(REPLACE "${begins}" "<script type=\"module\" src=\"servo.js\"></script>
<link rel=\"preload\" as=\"fetch\" crossorigin href=\"kerf.wasm\">
<script type=\"module\" src=\"try.js\"></script>
<link rel=\"stylesheet\" href=\"try.css\">${links}" text "${text}")
# A run here has its own words for what a bridge says. Those of a link to it: title, description, picture.
set(title "kerf in your browser: mill a tooth")
set(description "A haptic milling controller, an emulated device and a tooth, in one tab: lead the bur with mouse, finger or keys and \
see the force of each millisecond. Nothing to install, nothing is sent anywhere.")
string(REGEX REPLACE "<title>kerf</title>\n<meta name=\"description\"[^>]*>" "<title>${title}</title>
<meta name=\"description\" content=\"${description}\">
<meta property=\"og:type\" content=\"website\">
<meta property=\"og:title\" content=\"${title}\">
<meta property=\"og:description\" content=\"${description}\">
<meta property=\"og:image\" content=\"demo.png\">
<meta property=\"og:image:alt\" content=\"A bur in the cavity that it has cut into a molar\">
<meta name=\"twitter:card\" content=\"summary_large_image\">" text "${text}")
string(FIND "${text}" "og:image" at)
if(at EQUAL -1)
  message(FATAL_ERROR "index.cmake: ${PAGE} has no title before its description; write them in this order")
endif()
file(WRITE ${OUTPUT} "${text}")
