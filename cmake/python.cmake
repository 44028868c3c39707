# The module of the package for Python that simulates a block step by step (docs/python.md). It holds the whole simulator,
# so that it works wherever pip copies it. The rest of the package does without it.
option(GRAZE_PYTHON "Build the module for Python, if there are pybind11 and the headers of Python" ON)
if(GRAZE_PYTHON AND NOT GRAZE_SANITIZE)
  if(NOT DEFINED Python3_EXECUTABLE AND NOT DEFINED Python3_ROOT_DIR)
    set(Python3_ROOT_DIR /usr)  # the distribution's own, whose users have its h5py and pandas
    set(Python3_FIND_STRATEGY LOCATION)
  endif()
  find_package(Python3 3.9 COMPONENTS Interpreter Development.Module)
  find_package(pybind11 2.9 CONFIG QUIET)
endif()
if(pybind11_FOUND AND Python3_Development.Module_FOUND)
  add_library(graze_python MODULE jobs/python_module/module.cpp jobs/python_module/stepped_block.cpp)
  target_link_libraries(graze_python PRIVATE graze_simulation pybind11::headers Python3::Module)
  target_link_options(graze_python PRIVATE LINKER:--exclude-libs,ALL)  # its symbols are nobody else's
  # In the build, the package stands around it: PYTHONPATH=build/release/python.
  set(package ${CMAKE_BINARY_DIR}/python/graze)
  set_target_properties(graze_python PROPERTIES OUTPUT_NAME _block PREFIX "" SUFFIX .${Python3_SOABI}.so
    CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON LIBRARY_OUTPUT_DIRECTORY ${package})
  file(MAKE_DIRECTORY ${package})
  file(GLOB sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/jobs/python/graze/*.py ${PROJECT_SOURCE_DIR}/jobs/python/graze/py.typed)
  foreach(source ${sources})
    get_filename_component(name ${source} NAME)
    file(RELATIVE_PATH target ${package} ${source})
    file(CREATE_LINK ${target} ${package}/${name} SYMBOLIC)
  endforeach()
endif()
