# Part of the toolchain files musl-toolchain.cmake and manylinux-toolchain.cmake, which set LIGHTWELL_SDK_TARGET: zig's clang,
# from the sysroot that `cmake/sysroot_sdk TARGET` made. It is not made here, because nothing is downloaded at configure time.
# The environment variable LIGHTWELL_SYSROOT_SDK names another one.

set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR x86_64)
include("${CMAKE_CURRENT_LIST_DIR}/sdk_sysroot.cmake")

foreach(tool IN ITEMS AR RANLIB)
  string(TOLOWER ${tool} name)
  set(CMAKE_${tool} "${LIGHTWELL_SDK_SYSROOT}/bin/${name}" CACHE FILEPATH "")
endforeach()
set(CMAKE_C_COMPILER "${LIGHTWELL_SDK_SYSROOT}/bin/cc")
set(CMAKE_CXX_COMPILER "${LIGHTWELL_SDK_SYSROOT}/bin/c++")
