# The headers of the standard library, parsed once for all folders: a quarter of the time to compile them. Headers with much code
# of their own (nlohmann/json) cost every file more than they save the few that include them.
set(standard_header_names <algorithm> <array> <cmath> <filesystem> <functional> <map> <memory> <optional> <sstream> <string>
  <unordered_map> <variant> <vector>)
add_library(standard_headers OBJECT ${PROJECT_SOURCE_DIR}/cmake/standard_headers.cpp)
target_precompile_headers(standard_headers PRIVATE ${standard_header_names})

# compile_together(TARGET COUNT)
#
# Compiles COUNT files of the target as one, so that their includes are parsed once. CMAKE_UNITY_BUILD set to OFF prevents it:
# clang-tidy needs the command of each file.
function(compile_together target count)
  if(NOT DEFINED CMAKE_UNITY_BUILD)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE ${count})
  endif()
endfunction()

# scarp_module(NAME SOURCES ... NEEDS ... HIDES ...)
#
# One folder, one static library scarp_NAME. NEEDS are folders below it; HIDES are libraries that only its sources may see.
function(scarp_module name)
  cmake_parse_arguments(PARSE_ARGV 1 module "" "" "SOURCES;NEEDS;HIDES")
  add_library(scarp_${name} STATIC ${module_SOURCES})
  target_include_directories(scarp_${name} PUBLIC ${PROJECT_SOURCE_DIR})
  list(TRANSFORM module_NEEDS PREPEND scarp_)
  target_link_libraries(scarp_${name} PUBLIC ${module_NEEDS} PRIVATE ${module_HIDES})
  target_precompile_headers(scarp_${name} REUSE_FROM standard_headers)
endfunction()

# The tests of a program that the filter of GoogleTest selects, with these labels.
function(discover_tests name filter labels)
  gtest_discover_tests(${name}_tests TEST_FILTER "${filter}" NO_PRETTY_VALUES PROPERTIES LABELS "${labels}" DISCOVERY_TIMEOUT 60)
endfunction()

# scarp_tests(NAME NEEDS ...)
#
# All tests/NAME/*_test.cpp, those of rooms as well, in one program. Neighbours in the alphabet are compiled as one file and must
# not give the same name to two things. A test whose name starts with Slow carries the label slow instead of NAME. The others
# carry the label quick as well, except those that tests/NAME/not_quick.txt lists: one pattern of GoogleTest a line.
function(scarp_tests name)
  cmake_parse_arguments(PARSE_ARGV 1 tests "" "" "NEEDS")
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/${name}/*_test.cpp)
  if(NOT sources)
    return()
  endif()
  add_executable(${name}_tests ${sources})
  list(TRANSFORM tests_NEEDS PREPEND scarp_)
  target_link_libraries(${name}_tests PRIVATE ${tests_NEEDS} GTest::gmock GTest::gtest_main)
  target_compile_definitions(${name}_tests PRIVATE
    SCARP_SOURCE_DIR="${PROJECT_SOURCE_DIR}" SCARP_BINARY="${PROJECT_BINARY_DIR}/apps/scarp")
  # Four files at a time: what they take of the test library is compiled once, a third of the time to compile everything.
  compile_together(${name}_tests 4)
  # A test runs once: what matters is how soon it is compiled.
  target_compile_options(${name}_tests PRIVATE $<$<CONFIG:Release>:-O0>)
  if(TARGET core_tests AND NOT name STREQUAL core)
    target_precompile_headers(${name}_tests REUSE_FROM core_tests)
  else()
    target_precompile_headers(${name}_tests PRIVATE ${standard_header_names} <gmock/gmock.h> <gtest/gtest.h>)
  endif()
  set(slow "Slow*:*/Slow*")
  set(not_quick "")
  set(list ${CMAKE_CURRENT_SOURCE_DIR}/${name}/not_quick.txt)
  if(EXISTS ${list})
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${list})
    file(STRINGS ${list} not_quick REGEX "^[^#]")
    list(JOIN not_quick ":" not_quick)
    discover_tests(${name} "${not_quick}-${slow}" ${name})
  endif()
  # On its way into the file of tests CMake takes the list apart unless its semicolon is behind eight backslashes.
  string(REPEAT "\\" 8 escape)
  discover_tests(${name} "-${slow}:${not_quick}" "${name}${escape};quick")
  discover_tests(${name} "${slow}" slow)
endfunction()

# scarp_bench(NAME SOURCES ... NEEDS ... LIBRARIES ...)
#
# tests/bench/bench_NAME.cpp as a program beside the tests, built only when asked for: ./dev bench NAME.
function(scarp_bench name)
  cmake_parse_arguments(PARSE_ARGV 1 bench "" "" "SOURCES;NEEDS;LIBRARIES")
  list(TRANSFORM bench_SOURCES PREPEND bench/)
  add_executable(bench_${name} EXCLUDE_FROM_ALL bench/bench_${name}.cpp ${bench_SOURCES})
  list(TRANSFORM bench_NEEDS PREPEND scarp_)
  target_link_libraries(bench_${name} PRIVATE ${bench_NEEDS} ${bench_LIBRARIES})
  target_compile_definitions(bench_${name} PRIVATE SCARP_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
endfunction()

# scarp_fuzz(NAME NEEDS ...)
#
# tests/fuzz/fuzz_NAME.cpp gives any bytes to a reader. With SCARP_FUZZ it is a program of libFuzzer. Otherwise it is a test with
# the files of tests/fuzz/seeds/NAME and tests/fuzz/found/NAME.
function(scarp_fuzz name)
  cmake_parse_arguments(PARSE_ARGV 1 fuzz "" "" "NEEDS")
  add_executable(fuzz_${name} fuzz/fuzz_${name}.cpp)
  list(TRANSFORM fuzz_NEEDS PREPEND scarp_)
  target_link_libraries(fuzz_${name} PRIVATE ${fuzz_NEEDS})
  if(SCARP_FUZZ)
    target_link_options(fuzz_${name} PRIVATE -fsanitize=fuzzer)
  else()
    target_sources(fuzz_${name} PRIVATE fuzz/replay.cpp)
    set(inputs ${CMAKE_CURRENT_SOURCE_DIR}/fuzz)
    add_test(NAME Fuzz.${name} COMMAND fuzz_${name} ${inputs}/seeds/${name} ${inputs}/found/${name})
    set_tests_properties(Fuzz.${name} PROPERTIES LABELS fuzz)
  endif()
endfunction()
