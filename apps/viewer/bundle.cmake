# Writes BINARY/viewer_script.cpp, only where it changes; see CMakeLists.txt.

function(write_script script)
  file(CONFIGURE OUTPUT ${BINARY}/viewer_script.cpp @ONLY CONTENT [[
// Made from apps/viewer.
#include "apps/viewer/viewer_script.h"

namespace scarp {

std::string_view viewer_script() { return R"viewer(@script@)viewer"; }

}  // namespace scarp
]])
endfunction()

function(give_up reason)
  message("the viewer of reports is left out: ${reason}")
  write_script("")
endfunction()

if(NOT NODE OR NOT NPM)
  give_up("node or npm is missing")
  return()
endif()

foreach(file IN LISTS FILES)
  get_filename_component(folder ${BINARY}/${file} DIRECTORY)
  file(MAKE_DIRECTORY ${folder})
  file(COPY_FILE ${SOURCE}/${file} ${BINARY}/${file} ONLY_IF_DIFFERENT)
endforeach()

# Nothing of what is fetched is run while it is installed.
if(${BINARY}/package-lock.json IS_NEWER_THAN ${BINARY}/node_modules/.package-lock.json)
  execute_process(COMMAND ${NPM} ci --ignore-scripts --no-audit --no-fund --prefer-offline --fetch-retries=0
    WORKING_DIRECTORY ${BINARY} RESULT_VARIABLE failed OUTPUT_QUIET ERROR_VARIABLE messages)
  if(failed)
    give_up("npm ci: ${messages}")
    return()
  endif()
endif()

set(is_stale FALSE)
foreach(file IN LISTS FILES)
  if(${BINARY}/${file} IS_NEWER_THAN ${BINARY}/viewer.js)
    set(is_stale TRUE)
  endif()
endforeach()
if(is_stale)
  execute_process(COMMAND ${NODE} bundle.mjs viewer.js WORKING_DIRECTORY ${BINARY} RESULT_VARIABLE failed ERROR_VARIABLE messages)
  if(failed)
    file(REMOVE ${BINARY}/viewer.js)
    message(FATAL_ERROR "the viewer of reports cannot be bundled:\n${messages}")
  endif()
endif()
file(READ ${BINARY}/viewer.js script)
write_script("${script}")
