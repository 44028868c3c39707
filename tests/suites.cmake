# Writes the CTest file of one GoogleTest program: one test per suite, in a process of its own, so that the program is loaded
# once for all of them (which under sanitizers takes half a second).
#   cmake -D PROGRAM=… -D PREFIX=… -D FOLDER=… -D OUTPUT=… [-D "FILTER=patterns of GoogleTest's"] [-D COST=…] -P suites.cmake
# FOLDER is where the tests run. What FILTER leaves out is run neither here nor by CTest. What costs more begins earlier.
if(NOT FILTER)
  set(FILTER "*")
endif()
if(NOT COST)
  set(COST 1)
endif()
execute_process(COMMAND "${PROGRAM}" --gtest_list_tests "--gtest_filter=${FILTER}"
  OUTPUT_VARIABLE listed RESULT_VARIABLE code TIMEOUT 300)
if(NOT code EQUAL 0)
  message(FATAL_ERROR "${PROGRAM} --gtest_list_tests ended with ${code}:\n${listed}")
endif()

set(text "")
set(suite "")
set(tests "")
macro(end_suite)
  if(tests)
    list(JOIN tests ":" names)
    string(APPEND text "add_test([==[${PREFIX}${suite}]==] [==[${PROGRAM}]==] [==[--gtest_filter=${names}]==])\n"
      "set_tests_properties([==[${PREFIX}${suite}]==] PROPERTIES WORKING_DIRECTORY [==[${FOLDER}]==] TIMEOUT 900 COST ${COST})\n")
  endif()
endmacro()
string(REGEX REPLACE " *#[^\n]*" "" listed "${listed}")  # the values of parameters
string(REPLACE "\n" ";" lines "${listed}")
foreach(line IN LISTS lines)
  if(line MATCHES "^ +([^ ]+)$")  # the tests of a suite are indented
    list(APPEND tests "${suite}.${CMAKE_MATCH_1}")
  elseif(line MATCHES "^([^ ]+)\\.$")
    end_suite()
    set(suite "${CMAKE_MATCH_1}")
    set(tests "")
  endif()
endforeach()
end_suite()
if(text STREQUAL "" AND FILTER STREQUAL "*")
  message(FATAL_ERROR "${PROGRAM} --gtest_list_tests names no test:\n${listed}")
endif()
file(WRITE "${OUTPUT}" "${text}")
