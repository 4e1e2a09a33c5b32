# OpenVDB's find module lives in its own folder, needs Boost.Iostreams and zlib, and sets BUILD_SHARED_LIBS for whoever calls it.
file(GLOB openvdb_modules /usr/lib/*/cmake/OpenVDB)
list(APPEND CMAKE_MODULE_PATH ${openvdb_modules})
set(saved_shared_libs ${BUILD_SHARED_LIBS})
find_package(OpenVDB REQUIRED)
set(BUILD_SHARED_LIBS ${saved_shared_libs})

find_package(embree 3 REQUIRED)
find_package(TBB REQUIRED)
find_package(Eigen3 REQUIRED)
find_package(tomlplusplus REQUIRED)
find_package(CLI11 REQUIRED)
find_package(fmt REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(pugixml REQUIRED)
find_package(PNG REQUIRED)
find_package(ZLIB REQUIRED)
find_package(Threads REQUIRED)

# Its vector code rounds otherwise than plain code does, and otherwise again with another instruction set.
add_library(eigen INTERFACE)
target_link_libraries(eigen INTERFACE Eigen3::Eigen)
target_compile_definitions(eigen INTERFACE EIGEN_DONT_VECTORIZE EIGEN_DONT_PARALLELIZE)

# xxHash of Debian 12 ships no CMake file.
find_path(XXHASH_INCLUDE xxhash.h REQUIRED)
find_library(XXHASH_LIBRARY xxhash REQUIRED)
add_library(xxhash INTERFACE)
target_include_directories(xxhash SYSTEM INTERFACE ${XXHASH_INCLUDE})
target_link_libraries(xxhash INTERFACE ${XXHASH_LIBRARY})

# So does Clipper.
find_path(CLIPPER_INCLUDE polyclipping/clipper.hpp REQUIRED)
find_library(CLIPPER_LIBRARY polyclipping REQUIRED)
add_library(polyclipping INTERFACE)
target_include_directories(polyclipping SYSTEM INTERFACE ${CLIPPER_INCLUDE})
target_link_libraries(polyclipping INTERFACE ${CLIPPER_LIBRARY})

if(SCARP_BUILD_TESTS)
  find_package(GTest REQUIRED)
endif()
