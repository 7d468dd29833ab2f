# Read by cpack before it makes packages of a cross build: it finds dependencies with this program.
set(SHLIBDEPS_EXECUTABLE "${CMAKE_CURRENT_LIST_DIR}/cross_shlibdeps")
set(ENV{LIGHTWELL_SYSROOT_AARCH64} "${CPACK_LIGHTWELL_SYSROOT}")
