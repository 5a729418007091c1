# luxfield_room(NAME USES lib...): the static library luxfield_NAME from NAME/**/*.cc.
# OpenCL sources (*.cl, and *.clh headers shared with C++) in the room are embedded as strings, see embed_kernels.cmake.
function(luxfield_room name)
  cmake_parse_arguments(ARG "" "" "USES" ${ARGN})
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/${name}/*.cc)
  file(GLOB_RECURSE kernels CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/${name}/*.cl ${CMAKE_SOURCE_DIR}/${name}/*.clh)
  set(library luxfield_${name})
  if(NOT sources)
    add_library(${library} INTERFACE)
    target_include_directories(${library} INTERFACE ${CMAKE_SOURCE_DIR})
    target_link_libraries(${library} INTERFACE ${ARG_USES})
    return()
  endif()
  add_library(${library} STATIC ${sources})
  target_include_directories(${library} PUBLIC ${CMAKE_SOURCE_DIR})
  luxfield_foreign_headers(${library} ${ARG_USES})
  target_link_libraries(${library} PUBLIC ${ARG_USES})
  if(kernels)
    set(embedded ${CMAKE_BINARY_DIR}/generated/${name}_kernels.cc)
    add_custom_command(
      OUTPUT ${embedded}
      COMMAND ${CMAKE_COMMAND} -DOUTPUT=${embedded} -DROOM=${name} -DROOT=${CMAKE_SOURCE_DIR} "-DKERNELS=${kernels}"
              -P ${CMAKE_SOURCE_DIR}/cmake/embed_kernels.cmake
      DEPENDS ${kernels} ${CMAKE_SOURCE_DIR}/cmake/embed_kernels.cmake VERBATIM)
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

# luxfield_program(FOLDER NAME USES lib...): the executable build/NAME from FOLDER/main.cc and the static library
# luxfield_FOLDER from the other FOLDER/*.cc.
function(luxfield_program folder name)
  cmake_parse_arguments(ARG "" "" "USES" ${ARGN})
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/${folder}/*.cc)
  list(REMOVE_ITEM sources ${CMAKE_SOURCE_DIR}/${folder}/main.cc)
  set(library luxfield_${folder})
  add_library(${library} STATIC ${sources})
  luxfield_foreign_headers(${library} ${ARG_USES})
  target_link_libraries(${library} PUBLIC ${ARG_USES})
  add_executable(${name} ${folder}/main.cc)
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR})
  target_link_libraries(${name} PRIVATE ${library})
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
