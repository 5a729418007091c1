# luxfield_room(NAME USES lib... SOURCES file... [KERNELS file...]): the static library luxfield_NAME of the room's files, named
# from its folder. Kernels (*.cl, and *.clh headers shared with C++) are embedded as strings, see embed_kernels.cmake.
function(luxfield_room name)
  cmake_parse_arguments(ARG "" "" "USES;SOURCES;KERNELS" ${ARGN})
  set(library luxfield_${name})
  add_library(${library} STATIC ${ARG_SOURCES})
  target_include_directories(${library} PUBLIC ${LUXFIELD_INCLUDE})
  luxfield_foreign_headers(${library} ${ARG_USES})
  target_link_libraries(${library} PUBLIC ${ARG_USES})
  if(ARG_KERNELS)
    list(TRANSFORM ARG_KERNELS PREPEND ${CMAKE_CURRENT_SOURCE_DIR}/)
    set(embedded ${CMAKE_CURRENT_BINARY_DIR}/${name}_kernels.cc)
    add_custom_command(
      OUTPUT ${embedded}
      COMMAND ${CMAKE_COMMAND} -DOUTPUT=${embedded} -DROOM=${name} -DROOT=${PROJECT_SOURCE_DIR} "-DKERNELS=${ARG_KERNELS}"
              -P ${PROJECT_SOURCE_DIR}/cmake/embed_kernels.cmake
      DEPENDS ${ARG_KERNELS} ${PROJECT_SOURCE_DIR}/cmake/embed_kernels.cmake VERBATIM)
    # An object library of its own: device_bench is built from the same one.
    add_library(${library}_kernels OBJECT ${embedded})
    target_sources(${library} PRIVATE $<TARGET_OBJECTS:${library}_kernels>)
  endif()
endfunction()

# Our warnings are errors; other people's headers are system headers.
function(luxfield_foreign_headers target)
  foreach(library ${ARGN})
    if(TARGET ${library} AND NOT library MATCHES "^luxfield_")
      get_target_property(directories ${library} INTERFACE_INCLUDE_DIRECTORIES)
      if(directories)
        target_include_directories(${target} SYSTEM PUBLIC ${directories})
      endif()
    endif()
  endforeach()
endfunction()

# luxfield_tests(FOLDER USES lib... [DEPENDS target...] [UNDER program [argument...]]): tests/FOLDER/*_test.cc as one program, one
# ctest entry, run by another program if one is named.
function(luxfield_tests folder)
  cmake_parse_arguments(ARG "" "" "USES;DEPENDS;UNDER" ${ARGN})
  file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/tests/${folder}/*.cc)
  if(NOT sources)
    return()
  endif()
  set(program ${folder}_test)
  add_executable(${program} ${sources})
  target_include_directories(${program} PRIVATE ${CMAKE_SOURCE_DIR})  # as tests/<room>/<file>.h
  target_link_libraries(${program} PRIVATE ${ARG_USES} GTest::gtest GTest::gmock GTest::gtest_main)
  target_compile_definitions(${program} PRIVATE LUXFIELD_SOURCE_DIR="${CMAKE_SOURCE_DIR}"
                                                LUXFIELD_BINARY_DIR="${CMAKE_BINARY_DIR}")
  if(ARG_DEPENDS)
    foreach(dependency ${ARG_DEPENDS})
      if(TARGET ${dependency})
        add_dependencies(${program} ${dependency})
      endif()
    endforeach()
  endif()
  add_test(NAME ${folder} COMMAND ${ARG_UNDER} $<TARGET_FILE:${program}> WORKING_DIRECTORY ${CMAKE_BINARY_DIR})
  set_tests_properties(${folder} PROPERTIES TIMEOUT 3600)
endfunction()
