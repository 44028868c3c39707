# Debian packages of what `cmake --install` puts where: cmake --build build/release --target package. `graze` has all but
# the module for MPI, which is `graze-mpi`, so that a machine without MPI needs none of it.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME graze)
set(CPACK_PACKAGE_VENDOR Graze)
if(NOT CPACK_PACKAGE_CONTACT)  # who hands packages on names himself: -DCPACK_PACKAGE_CONTACT="Name <address>"
  set(CPACK_PACKAGE_CONTACT "The Graze developers <graze@localhost>")
endif()
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "find out in simulation how a robot fails")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL graze)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_GRAZE_PACKAGE_NAME graze)
set(CPACK_DEBIAN_GRAZE_PACKAGE_DEPENDS libassimp5)  # beside what it is linked with: loaded when a mesh is read
set(CPACK_DEBIAN_GRAZE_PACKAGE_SUGGESTS
  "graze-mpi, gnuplot-nox | gnuplot, gcc | c-compiler, make, g++ | c++-compiler, cmake, libeigen3-dev, libfmt-dev, python3-h5py, python3-pandas")
set(CPACK_COMPONENT_GRAZE_DESCRIPTION "A scenario becomes thousands of slightly different copies of a robot.
Each is simulated under each policy, and sorted into success, known and
unknown failure. Program, robots and scenarios, library and headers for
C++, a package for Python, manual pages.")
if(TARGET graze_mpi)
  list(APPEND CPACK_COMPONENTS_ALL mpi)
  set(CPACK_DEBIAN_MPI_PACKAGE_NAME graze-mpi)
  set(CPACK_DEBIAN_MPI_PACKAGE_DEPENDS "graze (= ${PROJECT_VERSION}), openmpi-bin")
  set(CPACK_COMPONENT_MPI_DESCRIPTION "Campaigns of graze over the ranks that mpirun or srun starts.")
endif()
include(CPack)
