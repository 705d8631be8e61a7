# debian/control and debian/changelog of the Debian packages and of the source package.
#   cmake -D OUT=FOLDER [-D MAINTAINER="NAME <ADDRESS>"] -P tools/packaging/debian.cmake
set(debian_root ${CMAKE_CURRENT_LIST_DIR}/../..)

# Before 1.0 a minor version may change the interface.
function(postchain_soversion version result)
  string(REGEX MATCH "^([0-9]+)(\\.[0-9]+)" match ${version})
  if(CMAKE_MATCH_1 EQUAL 0)
    set(${result} ${match} PARENT_SCOPE)
  else()
    set(${result} ${CMAKE_MATCH_1} PARENT_SCOPE)
  endif()
endfunction()

# The date is SOURCE_DATE_EPOCH if that is set. Build dependencies: tools/install_packages.sh.
function(postchain_debian_files version maintainer out)
  postchain_soversion(${version} soversion)
  string(TIMESTAMP date "%a, %d %b %Y %H:%M:%S +0000" UTC)
  file(READ ${debian_root}/tools/install_packages.sh script)
  if(NOT script MATCHES "\npackages=\\(([^)]+)\\)\ndeclare -A parts=\\(([^)]+)\\)")
    message(FATAL_ERROR "tools/install_packages.sh: no lists packages=(...) and parts=(...)")
  endif()
  set(lists "${CMAKE_MATCH_1}${CMAKE_MATCH_2}")
  string(REGEX REPLACE "\\[[a-z]+\\]=|\"" " " lists "${lists}")
  string(REGEX MATCHALL "[^ \n]+" packages "${lists}")
  list(REMOVE_DUPLICATES packages)
  list(REMOVE_ITEM packages g++)  # is on every machine that builds packages
  # Beside these: of the packages for Vulkan.
  list(APPEND packages file glslang-dev glslang-tools libspirv-cross-c-shared-dev libvulkan-dev)
  list(JOIN packages ", " build_depends)
  configure_file(${debian_root}/tools/packaging/debian/changelog.in ${out}/changelog @ONLY)
  configure_file(${debian_root}/tools/packaging/debian/control.in ${out}/control @ONLY)
endfunction()

if(CMAKE_SCRIPT_MODE_FILE AND OUT)
  file(STRINGS ${debian_root}/CMakeLists.txt project REGEX "^project\\(postchain VERSION")
  string(REGEX MATCH "[0-9.]+" version "${project}")
  postchain_debian_files(${version} "${MAINTAINER}" ${OUT})
endif()
