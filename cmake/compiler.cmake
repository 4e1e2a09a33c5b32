set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)

if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release)
endif()
set(CMAKE_CXX_FLAGS_RELEASE "-O3 -DNDEBUG")

# For a shared library; calls within it stay direct, as in a program.
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
add_compile_options($<$<CXX_COMPILER_ID:GNU>:-fno-semantic-interposition>)

# No contraction: the same bits from g++ and clang, SSE2 to AVX-512. No errno and no traps: square roots and selections vectorise.
add_compile_options(-Wall -Wextra -Wpedantic -ffp-contract=off -fno-math-errno -fno-trapping-math)

# The straight-line vectoriser of g++ 12 drops double -> float -> double where two values are rounded side by side.
add_compile_options($<$<CXX_COMPILER_ID:GNU>:-fno-tree-slp-vectorize>)

# With precompiled headers its heap is full from the start: no collection before it is three times as large. 7 % quicker.
add_compile_options("$<$<CXX_COMPILER_ID:GNU>:SHELL:--param ggc-min-heapsize=300000>")

# False alarm of g++ 12 on string literal + string (GCC bug 105651).
add_compile_options($<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>)

if(SCARP_WERROR)
  add_compile_options(-Werror)
endif()
if(SCARP_NATIVE)
  add_compile_options(-march=native)
elseif(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
  # SSE4.2: processors since 2009. Kernels that gain by more choose when the program is loaded (core/vector_kernel.h).
  add_compile_options(-march=x86-64-v2)
endif()
if(SCARP_COVERAGE)
  set(CMAKE_CXX_FLAGS_RELWITHDEBINFO "-O1 -g1")
  add_compile_options(--coverage)
  add_link_options(--coverage)
endif()
if(SCARP_ASAN OR SCARP_FUZZ)
  # Enough for a stack trace, and half the time to compile; assertions and bounds checks of the library are on.
  set(CMAKE_CXX_FLAGS_RELWITHDEBINFO "-O1 -g1 -D_GLIBCXX_ASSERTIONS")
  add_compile_options(-fsanitize=address,undefined -fno-sanitize-recover=undefined -fno-omit-frame-pointer)
  add_link_options(-fsanitize=address,undefined)
  # g++ 12 warns of std::variant members that another alternative would use, with sanitizers only.
  add_compile_options($<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>)
endif()

if(SCARP_TSAN)
  set(CMAKE_CXX_FLAGS_RELWITHDEBINFO "-O1 -g1")
  add_compile_options(-fsanitize=thread)
  add_link_options(-fsanitize=thread)
endif()

if(SCARP_FUZZ)
  # Every branch that is taken is told to libFuzzer, which clang has.
  add_compile_options(-fsanitize=fuzzer-no-link)
endif()

find_program(CCACHE ccache)
if(CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  # The sloppiness is what ccache needs to see through precompiled headers. What a file includes is taken from the compiler, which
  # knows it anyway, instead of a run of the preprocessor: a tenth of the time of a first build.
  set(CMAKE_CXX_COMPILER_LAUNCHER env CCACHE_SLOPPINESS=pch_defines,time_macros CCACHE_DEPEND=1 ${CCACHE})
endif()
