# SPDX-License-Identifier: Apache-2.0
# The bridge's index.html, begun by try.js. cmake -DOUTPUT=FILE -DPAGE=FILE -P index.cmake
cmake_minimum_required(VERSION 3.25)
file(READ ${PAGE} text)
set(begins "<script type=\"module\" src=\"kerf.js\"></script>")
string(FIND "${text}" "${begins}" at)
if(at EQUAL -1)
  message(FATAL_ERROR "index.cmake: ${PAGE} has no ${begins}; name what begins the page")
endif()
string(REPLACE "${begins}" "<script type=\"module\" src=\"try.js\"></script>
<link rel=\"modulepreload\" href=\"kerf.js\">
<link rel=\"stylesheet\" href=\"try.css\">" text "${text}")
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
