include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

# The component `board` contains exactly what a board needs. To install it:
#   cmake --install build/board-aarch64 --component board --strip --prefix DIR

# lightwell_install_sdk([<target>...])
# Installs the host SDK as the CMake package `lightwell` with the target lightwell::lightwell:
# static libraries, headers, .proto files; and liblightwell.so as the package's component `c`, with the target
# lightwell::lightwell_c, and for pkg-config as `lightwell`. Further targets given are exported, too, under their
# EXPORT_NAME. Needs lightwell_host_sdk and the libraries of proto, of which
# lightwell_proto_firmware is not installed.
function(lightwell_install_sdk)
  set_target_properties(lightwell_host_sdk PROPERTIES EXPORT_NAME lightwell)
  set_target_properties(lightwell_proto PROPERTIES EXPORT_NAME proto)
  # Applications link these, because the SDK's static library needs them, but never include their headers.
  set(needed lightwell_proto_messages)
  if(LIGHTWELL_WITH_GRPC)
    list(APPEND needed lightwell_proto_services)
  endif()
  if(LIGHTWELL_WITH_GRPC OR LIBWEBSOCKETS_FOUND)
    list(APPEND needed lightwell_pairing)
  endif()
  if(TARGET lightwell_mqtt_session)
    list(APPEND needed lightwell_mqtt_session)
  endif()
  foreach(library IN LISTS needed)
    string(REPLACE "lightwell_" "" name ${library})
    set_target_properties(${library} PROPERTIES EXPORT_NAME ${name})
  endforeach()
  # An example builds the same in this tree and against the installed package.
  add_library(lightwell::lightwell ALIAS lightwell_host_sdk)

  install(TARGETS lightwell_host_sdk lightwell_proto ${needed} ${ARGN}
          EXPORT lightwellTargets
          INCLUDES DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}")
  install(DIRECTORY "${PROJECT_SOURCE_DIR}/proto/include/" "${PROJECT_SOURCE_DIR}/host_sdk/include/"
          DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}"
          FILES_MATCHING PATTERN "*.hpp" PATTERN "*.h")
  install(DIRECTORY "${PROJECT_SOURCE_DIR}/proto/lightwell"
          DESTINATION "${CMAKE_INSTALL_DATADIR}/lightwell/proto"
          FILES_MATCHING PATTERN "*.proto")

  set(package_dir "${CMAKE_INSTALL_LIBDIR}/cmake/lightwell")
  install(EXPORT lightwellTargets NAMESPACE lightwell:: DESTINATION "${package_dir}")

  # A separate export set, so that applications of the C ABI build without gRPC and protobuf.
  install(TARGETS lightwell_c EXPORT lightwellCTargets
          INCLUDES DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}")
  install(EXPORT lightwellCTargets NAMESPACE lightwell:: DESTINATION "${package_dir}")
  configure_file("${PROJECT_SOURCE_DIR}/cmake/lightwell.pc.in" "${PROJECT_BINARY_DIR}/lightwell.pc" @ONLY)
  install(FILES "${PROJECT_BINARY_DIR}/lightwell.pc" DESTINATION "${CMAKE_INSTALL_LIBDIR}/pkgconfig")

  configure_package_config_file(
    "${PROJECT_SOURCE_DIR}/cmake/lightwellConfig.cmake.in"
    "${PROJECT_BINARY_DIR}/lightwellConfig.cmake"
    INSTALL_DESTINATION "${package_dir}")
  # Before 1.0 a minor version may change the API incompatibly.
  write_basic_package_version_file("${PROJECT_BINARY_DIR}/lightwellConfigVersion.cmake"
    COMPATIBILITY SameMinorVersion)
  install(FILES "${PROJECT_BINARY_DIR}/lightwellConfig.cmake"
                "${PROJECT_BINARY_DIR}/lightwellConfigVersion.cmake"
          DESTINATION "${package_dir}")
endfunction()
