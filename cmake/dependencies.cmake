# The libraries that each room links, and how they are found: read by the build and by the installed config package.
#
# luxfield_packages_ROOM lists PACKAGE|TARGET|PKGCONFIG: what find_package() calls it, the target, and the module, or the
# options, that stand for it in pkg-config files. Packages named opencv_... or pkg:NAME:MODULE[,MODULE] are found here.
set(luxfield_packages_core
    "OpenEXR|OpenEXR::OpenEXR|OpenEXR" "TBB|TBB::tbb|tbb" "fmt|fmt::fmt|fmt" "OpenSSL|OpenSSL::Crypto|libcrypto"
    "Threads|Threads::Threads|-pthread" "TIFF|TIFF::TIFF|libtiff-4"
    "pkg:LIBDEFLATE:libdeflate|PkgConfig::LIBDEFLATE|libdeflate")
set(luxfield_packages_formats "ZLIB|ZLIB::ZLIB|zlib")
set(luxfield_packages_pictures "opencv_core|luxfield::opencv_core|-lopencv_core")
set(luxfield_packages_hal "pkg:LIBUSB:libusb-1.0|PkgConfig::LIBUSB|libusb-1.0")
set(luxfield_packages_capture "pkg:CAIRO:cairo|PkgConfig::CAIRO|cairo")
set(luxfield_packages_reconstruct
    "Ceres|Ceres::ceres|-lceres" "glog|glog::glog|libglog" "opencv_core|luxfield::opencv_core|-lopencv_core"
    "opencv_imgproc|luxfield::opencv_imgproc|-lopencv_imgproc" "opencv_calib3d|luxfield::opencv_calib3d|-lopencv_calib3d")
set(luxfield_packages_scene
    "assimp|assimp::assimp|assimp" "embree|embree|-lembree3" "opencv_core|luxfield::opencv_core|-lopencv_core")
set(luxfield_packages_web "ZLIB|ZLIB::ZLIB|zlib")
set(luxfield_packages_render
    "OpenCL|OpenCL::OpenCL|OpenCL" "pkg:CAIRO:cairo|PkgConfig::CAIRO|cairo"
    "opencv_core|luxfield::opencv_core|-lopencv_core")
set(luxfield_packages_planning
    "opencv_core|luxfield::opencv_core|-lopencv_core" "opencv_photo|luxfield::opencv_photo|-lopencv_photo")
# Libraries of headers only: needed to build a room, not by those who link it.
set(luxfield_headers_core "nlohmann_json|nlohmann_json::nlohmann_json" "tomlplusplus|tomlplusplus::tomlplusplus")
set(luxfield_headers_lightfield "Eigen3|Eigen3::Eigen")
set(luxfield_headers_pictures "opencv_imgcodecs|luxfield::opencv_imgcodecs")  # loaded when a picture comes
set(luxfield_headers_cli "CLI11|CLI11::CLI11")

# Debian's packages of OpenCV's components carry no CMake files (only the meta-package does).
function(luxfield_find_opencv component)
  find_path(LUXFIELD_OPENCV_INCLUDE opencv2/core.hpp PATH_SUFFIXES opencv4)
  find_library(LUXFIELD_${component} ${component})
  mark_as_advanced(LUXFIELD_OPENCV_INCLUDE LUXFIELD_${component})
  if(LUXFIELD_OPENCV_INCLUDE AND LUXFIELD_${component} AND NOT TARGET luxfield::${component})
    add_library(luxfield::${component} INTERFACE IMPORTED GLOBAL)
    set_target_properties(luxfield::${component} PROPERTIES
      INTERFACE_INCLUDE_DIRECTORIES "${LUXFIELD_OPENCV_INCLUDE}" INTERFACE_LINK_LIBRARIES "${LUXFIELD_${component}}")
  endif()
endfunction()

# luxfield_find_pkg(NAME module...): the target PkgConfig::NAME, where pkg-config knows all the modules.
function(luxfield_find_pkg name)
  find_package(PkgConfig QUIET)
  if(TARGET PkgConfig::${name} OR NOT PKG_CONFIG_FOUND)
    return()
  endif()
  pkg_check_modules(${name} QUIET IMPORTED_TARGET GLOBAL ${ARGN})
  # LibRaw's file names the OpenMP that it uses itself; what calls it needs none, and Debian's Clang has none.
  if(TARGET PkgConfig::${name})
    foreach(property INTERFACE_LINK_OPTIONS INTERFACE_COMPILE_OPTIONS)
      get_target_property(options PkgConfig::${name} ${property})
      if(options)
        list(REMOVE_ITEM options -fopenmp)
        set_target_properties(PkgConfig::${name} PROPERTIES ${property} "${options}")
      endif()
    endforeach()
  endif()
endfunction()

# luxfield_find_libraries(MISSING PACKAGE|TARGET...): MISSING gets the packages that are not there.
function(luxfield_find_libraries missing)
  set(absent "")
  foreach(entry ${ARGN})
    string(REPLACE "|" ";" entry "${entry}")
    list(GET entry 0 package)
    list(GET entry 1 target)
    if(package MATCHES "^opencv_")
      luxfield_find_opencv(${package})
    elseif(package MATCHES "^pkg:([^:]+):(.+)$")
      string(REPLACE "," ";" modules "${CMAKE_MATCH_2}")
      luxfield_find_pkg(${CMAKE_MATCH_1} ${modules})
    elseif(package STREQUAL "embree" AND NOT TARGET embree)
      find_package(embree 3 QUIET)
    elseif(NOT TARGET ${target})
      find_package(${package} QUIET)
    endif()
    string(TOUPPER ${package} upper)
    foreach(version ${package}_VERSION ${package}_VERSION_STRING ${upper}_VERSION)
      if(${version})
        set_property(GLOBAL PROPERTY luxfield_version_${package} "${${version}}")
      endif()
    endforeach()
    if(NOT TARGET ${target})
      list(APPEND absent ${package})
    endif()
  endforeach()
  set(${missing} "${absent}" PARENT_SCOPE)
endfunction()
