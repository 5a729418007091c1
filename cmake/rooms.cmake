# LUXFIELD_CHOSEN: the rooms of LUXFIELD_COMPONENTS with those below them, from the ground up, all of whose libraries are
# there. The rooms below one are those that its CMakeLists.txt names.
macro(luxfield_choose_rooms)
  set(luxfield_wanted ${LUXFIELD_COMPONENTS})
  if(NOT luxfield_wanted)
    set(luxfield_wanted ${LUXFIELD_ROOMS})
  endif()
  foreach(room ${luxfield_wanted})
    if(NOT room IN_LIST LUXFIELD_ROOMS)
      list(JOIN LUXFIELD_ROOMS " " rooms)
      message(FATAL_ERROR "LUXFIELD_COMPONENTS names '${room}', which is no component; use some of ${rooms}")
    endif()
  endforeach()
  set(LUXFIELD_CHOSEN "")
  set(LUXFIELD_LEFT_OUT "")
  set(luxfield_from_above ${LUXFIELD_ROOMS})
  list(REVERSE luxfield_from_above)
  foreach(room ${luxfield_from_above})
    file(STRINGS ${PROJECT_SOURCE_DIR}/${room}/CMakeLists.txt below REGEX "^    luxfield_[a-z]+$")
    string(REGEX REPLACE " *luxfield_" "" luxfield_below_${room} "${below}")
    if(room IN_LIST luxfield_wanted)
      list(APPEND luxfield_wanted ${luxfield_below_${room}})
    endif()
  endforeach()
  foreach(room ${LUXFIELD_ROOMS})
    if(room IN_LIST luxfield_wanted)
      luxfield_find_libraries(missing ${luxfield_headers_${room}} ${luxfield_packages_${room}})
      set(luxfield_missing_${room} ${missing})
      foreach(below ${luxfield_below_${room}})
        list(APPEND luxfield_missing_${room} ${luxfield_missing_${below}})
      endforeach()
      list(REMOVE_DUPLICATES luxfield_missing_${room})
      list(JOIN luxfield_missing_${room} ", " missing)
      if(missing STREQUAL "")
        list(APPEND LUXFIELD_CHOSEN ${room})
      elseif(PROJECT_IS_TOP_LEVEL OR LUXFIELD_COMPONENTS)
        message(FATAL_ERROR "luxfield's room ${room} needs ${missing}: not found; install what packages.txt lists, or name "
                            "the rooms to build in LUXFIELD_COMPONENTS")
      else()
        message(STATUS "luxfield::${room} is left out, for want of ${missing}")
      endif()
    endif()
  endforeach()
endmacro()

# luxfield_room(NAME USES lib... [HEADERS file...] SOURCES file... [KERNELS file...]): the library luxfield_NAME of the
# room's files, named from its folder; static, unless BUILD_SHARED_LIBS is set. HEADERS are what others may include.
# Kernels (*.cl, and *.clh headers shared with C++) are embedded as strings, see embed_kernels.cmake.
function(luxfield_room name)
  cmake_parse_arguments(ARG "" "" "USES;HEADERS;SOURCES;KERNELS" ${ARGN})
  set(library luxfield_${name})
  add_library(${library} ${ARG_SOURCES})
  add_library(luxfield::${name} ALIAS ${library})
  target_compile_features(${library} PUBLIC cxx_std_20)
  set_target_properties(${library} PROPERTIES EXPORT_NAME ${name} LUXFIELD_HEADERS "${ARG_HEADERS}" VERSION ${PROJECT_VERSION}
    SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR} INSTALL_RPATH $ORIGIN)
  target_include_directories(${library} PUBLIC $<BUILD_INTERFACE:${LUXFIELD_INCLUDE}>
                                               $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  luxfield_foreign_headers(${library} ${ARG_USES})
  # Who links an installed library needs none of those that are headers only.
  list(TRANSFORM ARG_USES REPLACE "^(nlohmann_json::.*|tomlplusplus::.*|Eigen3::.*|CLI11::.*)$" "$<BUILD_INTERFACE:\\1>")
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
    set_target_properties(${library}_kernels PROPERTIES POSITION_INDEPENDENT_CODE ${BUILD_SHARED_LIBS})
    target_sources(${library} PRIVATE $<TARGET_OBJECTS:${library}_kernels>)
  endif()
endfunction()

# Our warnings are errors; other people's headers are system headers.
function(luxfield_foreign_headers target)
  foreach(library ${ARGN})
    if(TARGET ${library} AND NOT library MATCHES "^luxfield_")
      get_target_property(directories ${library} INTERFACE_INCLUDE_DIRECTORIES)
      if(directories)
        target_include_directories(${target} SYSTEM PUBLIC "$<BUILD_INTERFACE:${directories}>")
      endif()
    endif()
  endforeach()
endfunction()

# luxfield_tests(FOLDER USES lib... [DEPENDS target...] [UNDER program [argument...]] [SERIAL] [LOCK] [WHOLE]):
# tests/FOLDER/*.cc as one program, run by another program if one is named. Each of its suites is an entry FOLDER.SUITE
# of CTest, beside which nothing else runs if it is SERIAL, and none of its own if it has a LOCK; a program that is dear
# to start is WHOLE: one entry, FOLDER.
function(luxfield_tests folder)
  cmake_parse_arguments(ARG "SERIAL;LOCK;WHOLE" "" "USES;DEPENDS;UNDER" ${ARGN})
  file(GLOB sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/tests/${folder}/*.cc)
  if(NOT sources)
    return()
  endif()
  if(NOT TARGET luxfield_test_main)
    add_library(luxfield_test_main OBJECT ${PROJECT_SOURCE_DIR}/tests/test_main.cc)
    target_link_libraries(luxfield_test_main PUBLIC GTest::gtest GTest::gmock)
  endif()
  set(program ${folder}_test)
  add_executable(${program} ${sources})
  target_include_directories(${program} PRIVATE ${PROJECT_SOURCE_DIR})  # as tests/<room>/<file>.h
  target_link_libraries(${program} PRIVATE ${ARG_USES} luxfield_test_main)
  target_compile_definitions(${program} PRIVATE LUXFIELD_SOURCE_DIR="${PROJECT_SOURCE_DIR}"
                                                LUXFIELD_BINARY_DIR="${PROJECT_BINARY_DIR}")
  if(ARG_DEPENDS)
    foreach(dependency ${ARG_DEPENDS})
      if(TARGET ${dependency})
        add_dependencies(${program} ${dependency})
      endif()
    endforeach()
  endif()
  set(properties TIMEOUT 3600)
  if(ARG_SERIAL)
    list(APPEND properties RUN_SERIAL TRUE)
  endif()
  if(ARG_LOCK)
    list(APPEND properties RESOURCE_LOCK ${folder})
  endif()
  if(ARG_WHOLE)
    add_test(NAME ${folder} COMMAND ${ARG_UNDER} $<TARGET_FILE:${program}> WORKING_DIRECTORY ${PROJECT_BINARY_DIR})
    set_tests_properties(${folder} PROPERTIES ${properties})
    return()
  endif()
  set(suites ${CMAKE_CURRENT_BINARY_DIR}/${program}_suites.cmake)
  list(JOIN properties " " properties)
  add_custom_command(
    TARGET ${program} POST_BUILD
    COMMAND ${CMAKE_COMMAND} -DOUTPUT=${suites} -DROOM=${folder} -DPROGRAM=$<TARGET_FILE:${program}> "-DUNDER=${ARG_UNDER}"
            -DFOLDER=${PROJECT_BINARY_DIR} "-DPROPERTIES=${properties}" -P ${PROJECT_SOURCE_DIR}/cmake/list_suites.cmake
    BYPRODUCTS ${suites} VERBATIM)
  # A program that is not built yet is an entry that fails.
  set(include ${CMAKE_CURRENT_BINARY_DIR}/${program}_entries.cmake)
  file(WRITE ${include} "if(EXISTS [==[${suites}]==])
  include([==[${suites}]==])
else()
  add_test(${folder}.not_built ${program}_is_not_built)
endif()
")
  set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES ${include})
endfunction()
