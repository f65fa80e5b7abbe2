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
# A run here has its own words for what a bridge says.
string(REPLACE "<title>kerf</title>" "<title>kerf in your browser</title>" text "${text}")
file(WRITE ${OUTPUT} "${text}")
