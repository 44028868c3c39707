# What `cmake --install` puts where: the program, its data, one shared library with the headers of its public face, and a
# CMake package (docs/library.md).
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

# Everything below the command line in one library, so that who links it need not know what it is made of.
set(rooms sampling settings model physics control scenarios simulation archive analysis)
if(TARGET graze_physics_AVX2)
  list(APPEND rooms physics_AVX2 physics_AVX512 control_AVX2 control_AVX512)
endif()
list(TRANSFORM rooms REPLACE "(.+)" "$<TARGET_OBJECTS:graze_\\1>" OUTPUT_VARIABLE objects)
add_library(graze_shared SHARED ${objects})
set_target_properties(graze_shared PROPERTIES OUTPUT_NAME graze EXPORT_NAME graze LINKER_LANGUAGE CXX
  VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
target_link_libraries(graze_shared
  PUBLIC Eigen3::Eigen fmt::fmt
  PRIVATE yaml-cpp PkgConfig::URDFDOM PkgConfig::TINYXML2 PkgConfig::QHULL PkgConfig::BULLET PkgConfig::NETTLE hdf5::hdf5
    nlohmann_json::nlohmann_json Threads::Threads ${CMAKE_DL_LIBS})
target_compile_features(graze_shared PUBLIC cxx_std_20)
target_include_directories(graze_shared INTERFACE $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/graze>)
# Who links it may compile for a newer processor; records hold Eigen types, whose layout must stay what it is here.
target_compile_definitions(graze_shared INTERFACE EIGEN_MAX_ALIGN_BYTES=16
  $<$<TARGET_EXISTS:graze_physics_AVX2>:GRAZE_X86_KERNELS>)

set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME graze)  # cmake/package.cmake
install(TARGETS graze RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
install(TARGETS graze_shared EXPORT graze LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
# Where jobs/campaign/program_module.h looks for them.
install(TARGETS graze_page_server LIBRARY DESTINATION lib/graze)
if(TARGET graze_mpi)
  install(TARGETS graze_mpi LIBRARY DESTINATION lib/graze COMPONENT mpi)
endif()
install(DIRECTORY data/ DESTINATION ${CMAKE_INSTALL_DATADIR}/graze)
install(DIRECTORY jobs/python DESTINATION ${CMAKE_INSTALL_DATADIR}/graze  # for pip (docs/python.md)
  PATTERN "__pycache__" EXCLUDE PATTERN "build" EXCLUDE PATTERN "*.egg-info" EXCLUDE)
if(TARGET graze_python)
  install(TARGETS graze_python LIBRARY DESTINATION ${CMAKE_INSTALL_DATADIR}/graze/python/graze)
endif()
foreach(folder sampling scenarios simulation archive analysis engine)
  install(DIRECTORY ${folder} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/graze FILES_MATCHING PATTERN "*.h"
    PATTERN "lane_physics" EXCLUDE PATTERN "bullet" EXCLUDE PATTERN "shared_object.h" EXCLUDE)
endforeach()

# For controllers of others: <graze/policy.h>.
install(FILES graze/policy.h graze/policy.hpp DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/graze)

# Manual pages and what shells load to complete words, written by the program from its own option tables.
set(written ${CMAKE_BINARY_DIR}/written)
add_custom_command(OUTPUT ${written}/done
  COMMAND ${CMAKE_COMMAND} -E rm -rf ${written}
  COMMAND graze manual ${written}/man1
  COMMAND sh -c "cd written && gzip -9n man1/*.1 && for shell in bash zsh fish; do $1 completion $shell >$shell || exit; done" sh
    $<TARGET_FILE:graze>
  COMMAND ${CMAKE_COMMAND} -E touch ${written}/done
  WORKING_DIRECTORY ${CMAKE_BINARY_DIR} DEPENDS graze COMMENT "Writing manual pages and completions" VERBATIM)
add_custom_target(graze_written ALL DEPENDS ${written}/done)
install(DIRECTORY ${written}/man1 DESTINATION ${CMAKE_INSTALL_MANDIR})
install(FILES ${written}/bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME graze)
install(FILES ${written}/zsh DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions RENAME _graze)
install(FILES ${written}/fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d RENAME graze.fish)
install(DIRECTORY docs/ DESTINATION ${CMAKE_INSTALL_DOCDIR})
# Installed they stand beside what they refer to.
foreach(page README CHANGELOG)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${page}.md)
  file(READ ${page}.md text)
  string(REPLACE "](docs/" "](" text "${text}")
  file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/pages/${page}.md CONTENT "${text}" @ONLY)
  install(FILES ${CMAKE_BINARY_DIR}/pages/${page}.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
endforeach()
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} RENAME copyright)
if(TARGET graze_mpi)
  install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR}-mpi RENAME copyright COMPONENT mpi)
endif()

set(package ${CMAKE_INSTALL_LIBDIR}/cmake/graze)
install(EXPORT graze NAMESPACE graze:: FILE grazeTargets.cmake DESTINATION ${package})
configure_package_config_file(cmake/grazeConfig.cmake.in ${CMAKE_BINARY_DIR}/generated/grazeConfig.cmake
  INSTALL_DESTINATION ${package} PATH_VARS CMAKE_INSTALL_DATADIR)
write_basic_package_version_file(${CMAKE_BINARY_DIR}/generated/grazeConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/generated/grazeConfig.cmake ${CMAKE_BINARY_DIR}/generated/grazeConfigVersion.cmake
  DESTINATION ${package})

include(cmake/package.cmake)
