# What `cmake --install` puts under its prefix: each room as a component (library, public headers, pkg-config file), the
# config package and the program with its data. Of a build of some rooms only those are installed, and the config package
# says what is missing.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)
set(LUXFIELD_CMAKE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/luxfield)
set(luxfield_config_rooms "")

# The lines of a room's pkg-config file: those below it and modules in Requires, other options in Libs.
function(luxfield_pkg_config room)
  set(requires "")
  set(libraries "")
  foreach(below ${luxfield_below_${room}})
    list(APPEND requires luxfield-${below})
  endforeach()
  foreach(entry ${luxfield_packages_${room}})
    string(REGEX REPLACE "^.*[|]" "" module "${entry}")
    if(module MATCHES "^-")
      list(APPEND libraries ${module})
    else()
      list(APPEND requires ${module})
    endif()
  endforeach()
  list(JOIN requires " " LUXFIELD_REQUIRES)
  list(JOIN libraries " " LUXFIELD_LIBRARIES)
  set(LUXFIELD_ROOM ${room})
  # The prefix is where the file lies, wherever that is.
  file(RELATIVE_PATH LUXFIELD_UP /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
  configure_file(cmake/luxfield.pc.in ${PROJECT_BINARY_DIR}/pkgconfig/luxfield-${room}.pc @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/pkgconfig/luxfield-${room}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig
          COMPONENT ${room})
endfunction()

function(luxfield_install_room room)
  install(TARGETS luxfield_${room} EXPORT luxfield-${room}
          ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT ${room} OPTIONAL
          LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT ${room} OPTIONAL)
  install(EXPORT luxfield-${room} NAMESPACE luxfield:: FILE luxfield-${room}-targets.cmake
          DESTINATION ${LUXFIELD_CMAKE_DIR} COMPONENT ${room})
  get_target_property(headers luxfield_${room} LUXFIELD_HEADERS)
  foreach(header ${headers})
    get_filename_component(folder ${room}/${header} DIRECTORY)
    install(FILES ${PROJECT_SOURCE_DIR}/${room}/${header} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/luxfield/${folder}
            COMPONENT ${room})
  endforeach()
  luxfield_pkg_config(${room})
endfunction()

foreach(room ${LUXFIELD_CHOSEN})
  if(NOT room MATCHES "^(planning|shard|cli)$")  # of the program only
    luxfield_install_room(${room})
    string(APPEND luxfield_config_rooms
           "list(APPEND luxfield_rooms ${room})\nset(luxfield_below_${room} ${luxfield_below_${room}})\n")
  endif()
endforeach()
install(FILES ${LUXFIELD_INCLUDE}/luxfield/version.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/luxfield COMPONENT core)

string(REPLACE ";" "\" \"" LUXFIELD_HAL_PACKAGES "\"${luxfield_packages_hal}\"")
if(BUILD_SHARED_LIBS)
  set(LUXFIELD_LIBRARY_NAME "${CMAKE_SHARED_LIBRARY_PREFIX}luxfield_\${room}${CMAKE_SHARED_LIBRARY_SUFFIX}")
else()
  set(LUXFIELD_LIBRARY_NAME "${CMAKE_STATIC_LIBRARY_PREFIX}luxfield_\${room}${CMAKE_STATIC_LIBRARY_SUFFIX}")
endif()
configure_package_config_file(cmake/luxfieldConfig.cmake.in ${PROJECT_BINARY_DIR}/luxfieldConfig.cmake
                              INSTALL_DESTINATION ${LUXFIELD_CMAKE_DIR} PATH_VARS CMAKE_INSTALL_LIBDIR)
# Until 1.0 a minor version may change the interface.
write_basic_package_version_file(${PROJECT_BINARY_DIR}/luxfieldConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/luxfieldConfig.cmake ${PROJECT_BINARY_DIR}/luxfieldConfigVersion.cmake
        DESTINATION ${LUXFIELD_CMAKE_DIR} COMPONENT core)
install(FILES cmake/dependencies.cmake DESTINATION ${LUXFIELD_CMAKE_DIR} COMPONENT core)

if(TARGET luxfield_cli)
  install(TARGETS luxfield RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT program OPTIONAL)
  install(TARGETS luxfield_verbs RUNTIME DESTINATION ${LUXFIELD_LIBEXECDIR} COMPONENT program OPTIONAL)
  install(DIRECTORY data DESTINATION ${CMAKE_INSTALL_DATADIR}/luxfield COMPONENT data USE_SOURCE_PERMISSIONS)
  install(FILES bridges/blender/luxfield_lamp.py bridges/mitsuba/luxfield_mitsuba.py
          DESTINATION ${CMAKE_INSTALL_DATADIR}/luxfield/bridges COMPONENT data)
  install(DIRECTORY bridges/judges DESTINATION ${CMAKE_INSTALL_DATADIR}/luxfield/bridges COMPONENT data
          USE_SOURCE_PERMISSIONS PATTERN __pycache__ EXCLUDE)
endif()
