# Cross-compiles the SDK for x86-64 Linux with musl.
set(LIGHTWELL_SDK_TARGET musl CACHE STRING "")
include("${CMAKE_CURRENT_LIST_DIR}/zig_toolchain.cmake")

# zig links programs statically, so that they run on a machine without musl, unless they use liblightwell.so: then they need
# musl's loader, Debian's package musl.
