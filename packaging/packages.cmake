# Debian packages of an installed build (`./run packages`): luxfield, luxfield-data, luxfield-dev and python3-luxfield.
set(manuals ${PROJECT_BINARY_DIR}/manuals)
add_custom_target(manuals
  COMMAND ${Python_EXECUTABLE} -B ${PROJECT_SOURCE_DIR}/packaging/man_pages.py $<TARGET_FILE:luxfield> ${PROJECT_VERSION}
          ${manuals}/man
  COMMAND ${Python_EXECUTABLE} -B ${PROJECT_SOURCE_DIR}/packaging/completions.py $<TARGET_FILE:luxfield>
          ${manuals}/completions
  VERBATIM)
add_dependencies(manuals luxfield)
if(LUXFIELD_BUILD_BENCH)
  add_dependencies(manuals luxfield_bench_program)
endif()
if(LUXFIELD_VIEW)
  add_dependencies(manuals luxfield_view_program)
endif()
# What is not made is not installed.
install(DIRECTORY ${manuals}/man/ DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT program OPTIONAL)
install(FILES ${manuals}/completions/luxfield.bash RENAME luxfield COMPONENT program OPTIONAL
        DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions)
install(FILES ${manuals}/completions/_luxfield COMPONENT program OPTIONAL
        DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions)
install(FILES ${manuals}/completions/luxfield.fish COMPONENT program OPTIONAL
        DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d)
install(FILES packaging/luxfield-mime.xml RENAME luxfield.xml DESTINATION ${CMAKE_INSTALL_DATADIR}/mime/packages
        COMPONENT program)
if(NOT SKBUILD)  # devices for users who are not root: where udev looks, below /usr and /usr/local
  install(FILES packaging/udev/60-luxfield.rules DESTINATION lib/udev/rules.d COMPONENT program)
endif()
if(LUXFIELD_VIEW)  # the window, in menus and software centres
  install(FILES packaging/luxfield.desktop DESTINATION ${CMAKE_INSTALL_DATADIR}/applications COMPONENT program)
  install(FILES packaging/luxfield.svg DESTINATION ${CMAKE_INSTALL_DATADIR}/icons/hicolor/scalable/apps COMPONENT program)
  install(FILES packaging/luxfield.metainfo.xml RENAME org.luxfield.Luxfield.metainfo.xml
          DESTINATION ${CMAKE_INSTALL_DATADIR}/metainfo COMPONENT program)
endif()

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME luxfield)
set(CPACK_PACKAGE_VENDOR luxfield)
set(CPACK_PACKAGE_CONTACT "luxfield maintainers <maintainers@users.noreply.luxfield.example>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "measure real luminaires as light fields")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR}/packages)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_COMPONENTS_GROUPING ONE_PER_GROUP)
set(CPACK_COMPONENTS_ALL "")

# luxfield_package(NAME COMPONENTS component... SUMMARY text DESCRIPTION text [DEPENDS text] [RECOMMENDS text]
# [ARCHITECTURE name] [SECTION name] [SHARED_LIBRARIES])
macro(luxfield_package name)
  cmake_parse_arguments(ARG "SHARED_LIBRARIES" "SUMMARY;DESCRIPTION;DEPENDS;RECOMMENDS;ARCHITECTURE;SECTION" "COMPONENTS" ${ARGN})
  string(MAKE_C_IDENTIFIER ${name} group)
  string(TOUPPER ${group} upper)
  set(CPACK_COMPONENT_GROUP_${upper}_DESCRIPTION "${ARG_DESCRIPTION}")
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${name})
  set(CPACK_DEBIAN_${upper}_DESCRIPTION "${ARG_SUMMARY}\n${ARG_DESCRIPTION}")
  set(CPACK_DEBIAN_${upper}_PACKAGE_DEPENDS "${ARG_DEPENDS}")
  set(CPACK_DEBIAN_${upper}_PACKAGE_RECOMMENDS "${ARG_RECOMMENDS}")
  set(CPACK_DEBIAN_${upper}_PACKAGE_SHLIBDEPS ${ARG_SHARED_LIBRARIES})
  if(ARG_ARCHITECTURE)
    set(CPACK_DEBIAN_${upper}_PACKAGE_ARCHITECTURE ${ARG_ARCHITECTURE})
  endif()
  if(ARG_SECTION)
    set(CPACK_DEBIAN_${upper}_PACKAGE_SECTION ${ARG_SECTION})
  endif()
  if(CMAKE_INSTALL_PREFIX STREQUAL "/usr")  # as ./run packages configures it
    # A package states its licence and changes where Debian looks for them.
    set(documents ${PROJECT_BINARY_DIR}/packaging/${name})
    file(MAKE_DIRECTORY ${documents})
    set(LUXFIELD_PACKAGE ${name})
    install(FILES packaging/copyright DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${name} COMPONENT documents_${group})
    string(TIMESTAMP date "%a, %d %b %Y 00:00:00 +0000" UTC)
    configure_file(packaging/changelog.in ${documents}/changelog @ONLY)
    configure_file(packaging/lintian-overrides.in ${documents}/overrides @ONLY)
    install(FILES ${documents}/overrides RENAME ${name} DESTINATION ${CMAKE_INSTALL_DATADIR}/lintian/overrides
            COMPONENT documents_${group})
    find_program(GZIP gzip)
    if(GZIP)
      execute_process(COMMAND ${GZIP} -9nc ${documents}/changelog OUTPUT_FILE ${documents}/changelog.Debian.gz)
      install(FILES ${documents}/changelog.Debian.gz DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${name}
              COMPONENT documents_${group})
    endif()
  endif()
  foreach(component ${ARG_COMPONENTS} documents_${group})
    string(TOUPPER ${component} upper_component)
    set(CPACK_COMPONENT_${upper_component}_GROUP ${group})
    list(APPEND CPACK_COMPONENTS_ALL ${component})
  endforeach()
endmacro()

set(version "${PROJECT_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE}")
# What is loaded when it is needed is in no program's list of libraries: libopencv_imgcodecs.so.406 is of
# libopencv-imgcodecs406.
get_property(codecs GLOBAL PROPERTY luxfield_opencv_codecs)
string(REGEX REPLACE "^lib(.+)_(.+)[.]so[.](.+)$" "lib\\1-\\2\\3" codecs "${codecs}")
luxfield_package(luxfield COMPONENTS program SHARED_LIBRARIES
  SUMMARY "measure real luminaires as light fields and light scenes with them"
  DESCRIPTION "A lab captures what a lamp projects through optical filters in brackets of\nexposures; luxfield plans and takes the frames, merges and reconstructs them\nas a light field with error bars, and lights virtual scenes with it.\nThis package has the program with all verbs."
  DEPENDS "luxfield-data (= ${version}), ${codecs}"
  RECOMMENDS "pocl-opencl-icd | opencl-icd")
luxfield_package(luxfield-data COMPONENTS data ARCHITECTURE all
  SUMMARY "labs, plans and scenes for luxfield"
  DESCRIPTION "Simulated labs, plans of measurements and scenes that the demonstration and\nthe examples of luxfield use, and what makes its open data set."
  DEPENDS "python3")
set(development ${LUXFIELD_CHOSEN})
list(REMOVE_ITEM development planning cli)
luxfield_package(luxfield-dev COMPONENTS ${development} SECTION libdevel
  SUMMARY "libraries of luxfield for programs of others"
  DESCRIPTION "Headers, static libraries and the CMake and pkg-config files of luxfield: light\nfields of luminaires, environment maps, photometric and ray files, sessions,\nreconstruction, tables for sampling."
  DEPENDS "libopenexr-dev, libtbb-dev, libfmt-dev, libssl-dev, libtiff-dev, libdeflate-dev, nlohmann-json3-dev")
if(LUXFIELD_PYTHON)
  luxfield_package(python3-luxfield COMPONENTS python SHARED_LIBRARIES SECTION python
    SUMMARY "light fields of luminaires in Python"
    DESCRIPTION "Light fields, measurements and environment maps as numpy arrays, and every verb\nof luxfield as a function."
    DEPENDS "luxfield (= ${version}), python3, python3-numpy"
    RECOMMENDS "python3-matplotlib")
endif()
include(CPack)
