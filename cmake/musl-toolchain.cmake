# Cross-compiles the SDK for Linux with musl, x86-64 or 64-bit ARM, with zig's clang. Uses the sysroot that
# `cmake/sysroot_sdk musl` (or musl-aarch64) made, with its compiler; it is not made here, because nothing is downloaded at
# configure time. The environment variable LIGHTWELL_SYSROOT_SDK names another one. LIGHTWELL_SDK_TARGET is musl or
# musl-aarch64.

set(CMAKE_SYSTEM_NAME Linux)
set(LIGHTWELL_SDK_TARGET musl CACHE STRING "musl or musl-aarch64")
set(CMAKE_TRY_COMPILE_PLATFORM_VARIABLES LIGHTWELL_SDK_TARGET)
include("${CMAKE_CURRENT_LIST_DIR}/sdk_sysroot.cmake")

foreach(tool IN ITEMS AR RANLIB)
  string(TOLOWER ${tool} name)
  set(CMAKE_${tool} "${LIGHTWELL_SDK_SYSROOT}/bin/${name}" CACHE FILEPATH "")
endforeach()
set(CMAKE_C_COMPILER "${LIGHTWELL_SDK_SYSROOT}/bin/cc")
set(CMAKE_CXX_COMPILER "${LIGHTWELL_SDK_SYSROOT}/bin/c++")

if(LIGHTWELL_SDK_TARGET STREQUAL "musl-aarch64")
  set(CMAKE_SYSTEM_PROCESSOR aarch64)
  # The processor of the smallest supported board (Raspberry Pi 4).
  find_program(LIGHTWELL_QEMU_AARCH64 NAMES qemu-aarch64 qemu-aarch64-static)
  if(LIGHTWELL_QEMU_AARCH64)
    set(CMAKE_CROSSCOMPILING_EMULATOR "${LIGHTWELL_QEMU_AARCH64};-cpu;cortex-a72")
  endif()
else()
  set(CMAKE_SYSTEM_PROCESSOR x86_64)
endif()
# zig links programs statically, so that they run on a machine without musl, unless they use liblightwell.so: then they need
# musl's loader, Debian's package musl.
