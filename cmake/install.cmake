# What `cmake --install` puts into a prefix: the program, libscarp with its public headers, and the files that find_package(scarp)
# reads. The headers lie in their rooms; there they are found as scarp/..., with the includes to match.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(public_headers apps/simulator/simulation.h
    core/error.h core/frame.h core/material.h core/recipe/recipe_source.h core/tri_mesh.h core/vec3.h levelset/grid/layers.h
    levelset/grid/level_set.h levelset/metrology/cross_section.h levelset/metrology/metrology.h
    levelset/metrology/opening_names.h levelset/metrology/openings.h levelset/metrology/view_from_above.h)
list(TRANSFORM public_headers PREPEND ${PROJECT_SOURCE_DIR}/ OUTPUT_VARIABLE public_header_files)
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${public_header_files})
foreach(header ${public_headers})
  file(READ ${PROJECT_SOURCE_DIR}/${header} text)
  string(REGEX REPLACE "#include \"((core|levelset)/[^\"]+)\"" "#include \"scarp/\\1\"" text "${text}")
  string(REPLACE apps/simulator/simulation.h simulation.h installed ${header})
  file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/include/scarp/${installed} CONTENT "${text}" @ONLY)
endforeach()

# One library of all folders that a simulation needs: what those need besides is its own affair.
add_library(scarp_library SHARED)
foreach(folder core levelset mesh flux models simulator)
  target_sources(scarp_library PRIVATE $<TARGET_OBJECTS:scarp_${folder}>)
endforeach()
target_link_libraries(scarp_library PRIVATE scarp_simulator)
set_target_properties(scarp_library PROPERTIES
  OUTPUT_NAME scarp EXPORT_NAME scarp LINKER_LANGUAGE CXX VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION})
target_compile_features(scarp_library INTERFACE cxx_std_20)
target_include_directories(scarp_library INTERFACE
  $<BUILD_INTERFACE:${PROJECT_BINARY_DIR}/include> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)

set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/scarp)
install(TARGETS scarp)
install(TARGETS scarp_library EXPORT scarpTargets)
install(DIRECTORY ${PROJECT_BINARY_DIR}/include/scarp DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(EXPORT scarpTargets NAMESPACE scarp:: DESTINATION ${package_folder} FILE scarpConfig.cmake)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/scarpConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/scarpConfigVersion.cmake DESTINATION ${package_folder})
