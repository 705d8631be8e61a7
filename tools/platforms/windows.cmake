# Cross-compiles for Windows with Debian's mingw-w64. tools/platforms/windows.sh builds the other libraries and runs
# the tests. DLLs and programs need no runtime library of the compiler.
set(CMAKE_SYSTEM_NAME Windows)
set(CMAKE_SYSTEM_PROCESSOR x86_64)
set(CMAKE_C_COMPILER x86_64-w64-mingw32-gcc-posix)
set(CMAKE_CXX_COMPILER x86_64-w64-mingw32-g++-posix)
set(CMAKE_RC_COMPILER x86_64-w64-mingw32-windres)
# With -fipa-ra a caller relies on the registers that an inline function of its own unit leaves alone, but the linker
# may take another unit's copy of the function, compiled with other options: plan_tests crashed (GCC 12.2).
set(CMAKE_CXX_FLAGS_INIT -fno-ipa-ra)
foreach(kind EXE SHARED MODULE)
  set(CMAKE_${kind}_LINKER_FLAGS_INIT -static)
endforeach()

# libepoxy, GLM, headers of Vulkan, GoogleTest: nothing of the build machine is found in their place.
get_filename_component(libraries ${CMAKE_CURRENT_LIST_DIR}/../../build-windows/libraries ABSOLUTE)
set(CMAKE_FIND_ROOT_PATH ${libraries})
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
foreach(kind LIBRARY INCLUDE PACKAGE)
  set(CMAKE_FIND_ROOT_PATH_MODE_${kind} ONLY)
endforeach()
set(ENV{PKG_CONFIG_LIBDIR} ${libraries}/lib/pkgconfig)

set(CMAKE_CROSSCOMPILING_EMULATOR ${CMAKE_CURRENT_LIST_DIR}/wine.sh)
