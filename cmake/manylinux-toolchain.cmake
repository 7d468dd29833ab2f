# Cross-compiles the SDK for x86-64 Linux with glibc 2.28 or newer (the tag manylinux_2_28 of Python's wheels); programs and
# tests run on this machine.
set(LIGHTWELL_SDK_TARGET manylinux CACHE STRING "")
include("${CMAKE_CURRENT_LIST_DIR}/zig_toolchain.cmake")
