# Programs have HDF5 in them where its static library links: Debian's shared one brings libcurl and 25 libraries behind it,
# which took a quarter of the time in which the program starts. Other libraries link the shared one, and so do sanitized
# programs: there the tests know a fault that is HDF5's own (of a file that somebody has forged) by the library's name.
include(CheckCSourceCompiles)
find_library(GRAZE_HDF5_STATIC NAMES libhdf5.a libhdf5_serial.a HINTS ${HDF5_LIBRARY_DIRS} PATH_SUFFIXES hdf5/serial)
mark_as_advanced(GRAZE_HDF5_STATIC)
if(GRAZE_HDF5_STATIC AND NOT GRAZE_SANITIZE)
  set(CMAKE_REQUIRED_INCLUDES ${HDF5_INCLUDE_DIRS})
  set(CMAKE_REQUIRED_LIBRARIES ${GRAZE_HDF5_STATIC} sz z m ${CMAKE_DL_LIBS})
  check_c_source_compiles("#include <hdf5.h>\nint main(void) { return H5open() + (int)H5Fopen(\"\", 0, 0); }" GRAZE_HDF5_LINKS)
  set(graze_hdf5_static ${CMAKE_REQUIRED_LIBRARIES})
  unset(CMAKE_REQUIRED_INCLUDES)
  unset(CMAKE_REQUIRED_LIBRARIES)
endif()
add_library(graze_hdf5 INTERFACE)
if(graze_hdf5_static AND GRAZE_HDF5_LINKS)
  # The shared one stands behind, for its headers; nothing of it is left to be linked.
  target_link_libraries(graze_hdf5 INTERFACE "$<$<STREQUAL:$<TARGET_PROPERTY:TYPE>,EXECUTABLE>:${graze_hdf5_static}>")
endif()
target_link_libraries(graze_hdf5 INTERFACE hdf5::hdf5)
