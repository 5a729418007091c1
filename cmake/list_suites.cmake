# Writes OUTPUT: an entry ROOM.SUITE of CTest for every suite of the test program PROGRAM, run by UNDER if that is named.
# Run when the program has been built (luxfield_tests in rooms.cmake).
execute_process(COMMAND ${CMAKE_COMMAND} -E env ASAN_OPTIONS=detect_leaks=0 ${PROGRAM} --gtest_list_tests
                OUTPUT_VARIABLE listed RESULT_VARIABLE result)
if(result)
  message(FATAL_ERROR "${PROGRAM} does not list its tests: ${result}\n${listed}")
endif()
string(REGEX MATCHALL "(^|\n)[^ \n]+\\." suites "${listed}")
list(JOIN UNDER " " under)
set(entries "")
foreach(suite ${suites})
  string(REGEX REPLACE "^\n|\\.$" "" suite "${suite}")
  string(APPEND entries "add_test([==[${ROOM}.${suite}]==] ${under} [==[${PROGRAM}]==] [==[--gtest_filter=${suite}.*]==])
set_tests_properties([==[${ROOM}.${suite}]==] PROPERTIES WORKING_DIRECTORY [==[${FOLDER}]==] ${PROPERTIES})\n")
endforeach()
file(WRITE ${OUTPUT} "${entries}")
