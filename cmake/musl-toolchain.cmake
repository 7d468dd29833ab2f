# Cross-compiles the SDK for x86-64 Linux with musl, with zig's clang. Uses the sysroot that `cmake/sysroot_sdk musl` made,
# with its compiler; it is not made here, because nothing is downloaded at configure time. The environment variable
# LIGHTWELL_SYSROOT_SDK names another one.

set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR x86_64)
set(LIGHTWELL_SDK_TARGET musl CACHE STRING "")
include("${CMAKE_CURRENT_LIST_DIR}/sdk_sysroot.cmake")

foreach(tool IN ITEMS AR RANLIB)
  string(TOLOWER ${tool} name)
  set(CMAKE_${tool} "${LIGHTWELL_SDK_SYSROOT}/bin/${name}" CACHE FILEPATH "")
endforeach()
set(CMAKE_C_COMPILER "${LIGHTWELL_SDK_SYSROOT}/bin/cc")
set(CMAKE_CXX_COMPILER "${LIGHTWELL_SDK_SYSROOT}/bin/c++")

# zig links programs statically, so that they run on a machine without musl, unless they use liblightwell.so: then they need
# musl's loader, Debian's package musl.
