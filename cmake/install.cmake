include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

# What a board needs, and no more, is the component `board`, named where it is installed:
#   cmake --install build/board-aarch64 --component board --strip --prefix DIR

# lightwell_install_sdk([<target>...])
# Installs the host SDK as the CMake package `lightwell` with the target lightwell::lightwell:
# archives, headers, .proto files; and liblightwell.so as its component `c`, with the target
# lightwell::lightwell_c and for pkg-config as `lightwell`. The targets named besides are exported with it, under the names
# that their EXPORT_NAME gives. Needs lightwell_host_sdk and the four libraries of proto.
function(lightwell_install_sdk)
  set_target_properties(lightwell_host_sdk PROPERTIES EXPORT_NAME lightwell)
  set_target_properties(lightwell_proto PROPERTIES EXPORT_NAME proto)
  # Linked, never included: the SDK's static archive needs these three at the application's link.
  set_target_properties(lightwell_pairing PROPERTIES EXPORT_NAME pairing)
  set_target_properties(lightwell_proto_messages PROPERTIES EXPORT_NAME proto_messages)
  set_target_properties(lightwell_proto_services PROPERTIES EXPORT_NAME proto_services)
  set(mqtt_session)
  if(TARGET lightwell_mqtt_session)
    set_target_properties(lightwell_mqtt_session PROPERTIES EXPORT_NAME mqtt_session)
    set(mqtt_session lightwell_mqtt_session)
  endif()
  # An example builds the same in this tree and against the installed package.
  add_library(lightwell::lightwell ALIAS lightwell_host_sdk)

  install(TARGETS lightwell_host_sdk lightwell_proto lightwell_proto_messages
                  lightwell_proto_services lightwell_pairing ${mqtt_session} ${ARGN}
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

  # A set of its own: who takes the C ABI alone need not have gRPC and protobuf for building.
  install(TARGETS lightwell_c EXPORT lightwellCTargets
          INCLUDES DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}")
  install(EXPORT lightwellCTargets NAMESPACE lightwell:: DESTINATION "${package_dir}")
  configure_file("${PROJECT_SOURCE_DIR}/cmake/lightwell.pc.in" "${PROJECT_BINARY_DIR}/lightwell.pc" @ONLY)
  install(FILES "${PROJECT_BINARY_DIR}/lightwell.pc" DESTINATION "${CMAKE_INSTALL_LIBDIR}/pkgconfig")

  configure_package_config_file(
    "${PROJECT_SOURCE_DIR}/cmake/lightwellConfig.cmake.in"
    "${PROJECT_BINARY_DIR}/lightwellConfig.cmake"
    INSTALL_DESTINATION "${package_dir}")
  # Before 1.0 a minor version may break what an application was written against.
  write_basic_package_version_file("${PROJECT_BINARY_DIR}/lightwellConfigVersion.cmake"
    COMPATIBILITY SameMinorVersion)
  install(FILES "${PROJECT_BINARY_DIR}/lightwellConfig.cmake"
                "${PROJECT_BINARY_DIR}/lightwellConfigVersion.cmake"
          DESTINATION "${package_dir}")
endfunction()
