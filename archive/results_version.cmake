#Writes HEADER : a hash of every source that the bits of a trace depend on.Run as
#cmake - DROOT =… - DHEADER =… - P results_version.cmake
file(GLOB_RECURSE sources RELATIVE ${ROOT} ${ROOT}/engine/*.h ${ROOT}/engine/*.cpp ${ROOT}/sampling/*.h
  ${ROOT}/sampling/*.cpp ${ROOT}/scenarios/*.h ${ROOT}/scenarios/*.cpp ${ROOT}/jobs/block_run.*)
list(SORT sources)
set(all "")
foreach(source ${sources})
  file(SHA256 ${ROOT}/${source} hash)
  string(APPEND all "${source} ${hash}\n")
endforeach()
string(SHA256 hash "${all}")
string(SUBSTRING ${hash} 0 12 hash)
file(CONFIGURE OUTPUT ${HEADER} CONTENT "#pragma once\n#define GRAZE_RESULTS_HASH \"@hash@\"\n" @ONLY)
