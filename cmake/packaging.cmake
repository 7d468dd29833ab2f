# Debian packages by CPack: one of each install component (the list is in cmake/install.cmake). cmake/debian_packages builds
# them; cmake/debian/README.md describes them. Included last, because the components are those of the install rules above.
set(debian_x86_64 amd64)
set(debian_aarch64 arm64)
set(CPACK_DEBIAN_PACKAGE_ARCHITECTURE "${debian_${CMAKE_SYSTEM_PROCESSOR}}")
if(NOT LIGHTWELL_DPKG_DEB OR NOT CMAKE_SYSTEM_NAME STREQUAL Linux OR NOT CPACK_DEBIAN_PACKAGE_ARCHITECTURE
   OR (CMAKE_CROSSCOMPILING AND NOT CMAKE_SYSTEM_PROCESSOR STREQUAL aarch64))
  set_property(GLOBAL APPEND PROPERTY LIGHTWELL_FEATURES
    "Debian packages: left out, they are for Debian on amd64 and arm64, and need dpkg-deb")
  return()
endif()
set_property(GLOBAL APPEND PROPERTY LIGHTWELL_FEATURES "Debian packages: by cpack")

set(LIGHTWELL_PACKAGE_MAINTAINER "Lightwell developers <lightwell@localhost>" CACHE STRING
    "Debian packages: name and address of whoever distributes them")
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME lightwell)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_SOURCE lightwell)
set(CPACK_DEBIAN_PACKAGE_MAINTAINER "${LIGHTWELL_PACKAGE_MAINTAINER}")
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
set(package_version "${PROJECT_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE}")

# By DESTDIR, because the installed unit contains the program's path and configuration is outside of the prefix.
set(CPACK_SET_DESTDIR ON)
set(CPACK_INSTALL_PREFIX /usr)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
# The OpenXR layer loads liblightwell.so.1, which no installed package has; its package is a dependency below.
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS "${PROJECT_BINARY_DIR}/lib")
if(CMAKE_CROSSCOMPILING)
  # Dependencies by the packages of the sysroot, not of this machine.
  set(CPACK_PROJECT_CONFIG_FILE "${CMAKE_CURRENT_LIST_DIR}/debian/cross_packages.cmake")
  set(CPACK_LIGHTWELL_SYSROOT "${CMAKE_SYSROOT}")
endif()

# Documents of every package. gzip's -n leaves time and name out, so that equal texts are equal files.
string(TIMESTAMP package_date "%a, %d %b %Y %H:%M:%S +0000" UTC)
set(package_documents "${PROJECT_BINARY_DIR}/debian")
configure_file("${CMAKE_CURRENT_LIST_DIR}/debian/changelog.in" "${package_documents}/changelog.Debian" @ONLY)
file(COPY_FILE "${PROJECT_SOURCE_DIR}/CHANGELOG.md" "${package_documents}/changelog")
execute_process(COMMAND gzip -9nf changelog.Debian changelog WORKING_DIRECTORY "${package_documents}" COMMAND_ERROR_IS_FATAL ANY)

get_cmake_property(components COMPONENTS)
# Not installed by plain `cmake --install`: the content of Python's wheel.
list(REMOVE_ITEM components python_wheel)
set(CPACK_COMPONENTS_ALL)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING ONE_PER_GROUP)

# lightwell_debian_package(<package> <component> SECTION <section> DESCRIPTION <summary, then lines>
#                          [ARCHITECTURE all] [DEPENDS <package>...] [RECOMMENDS <package>...] [SUGGESTS <package>...])
# A package of one install component, if this build has it, with the control files in cmake/debian/<package>. The rules
# of the component <component>-debian are only for the package: plain `cmake --install` leaves them out. A macro, because
# CPack reads variables of the top level.
macro(lightwell_debian_package package component)
  if("${component}" IN_LIST components)
    cmake_parse_arguments(arg "" "SECTION;ARCHITECTURE" "DESCRIPTION;DEPENDS;RECOMMENDS;SUGGESTS" ${ARGN})
    lightwell_refuse_unparsed(${package} "${arg_UNPARSED_ARGUMENTS}")
    string(TOUPPER ${package} upper)
    list(REMOVE_ITEM components ${component})
    foreach(part IN ITEMS ${component} ${component}-debian)
      list(APPEND CPACK_COMPONENTS_ALL ${part})
      string(TOUPPER ${part} upper_part)
      set(CPACK_COMPONENT_${upper_part}_GROUP ${package})
    endforeach()
    install(FILES "${package_documents}/changelog.Debian.gz" "${package_documents}/changelog.gz"
                  "${CMAKE_CURRENT_SOURCE_DIR}/cmake/debian/copyright"
            DESTINATION share/doc/${package} COMPONENT ${component}-debian EXCLUDE_FROM_ALL)
    set(folder "${CMAKE_CURRENT_SOURCE_DIR}/cmake/debian/${package}")
    file(READ "${CMAKE_CURRENT_SOURCE_DIR}/cmake/debian/lintian-overrides" overrides)
    if(EXISTS "${folder}/lintian-overrides")
      file(READ "${folder}/lintian-overrides" own_overrides)
      string(APPEND overrides "${own_overrides}")
    endif()
    file(WRITE "${package_documents}/${package}.overrides" "${overrides}")
    install(FILES "${package_documents}/${package}.overrides"
            DESTINATION share/lintian/overrides RENAME ${package} COMPONENT ${component}-debian EXCLUDE_FROM_ALL)
    set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${package})
    set(CPACK_DEBIAN_${upper}_PACKAGE_SECTION ${arg_SECTION})
    list(JOIN arg_DESCRIPTION "\n" CPACK_DEBIAN_${upper}_DESCRIPTION)
    foreach(field IN ITEMS DEPENDS RECOMMENDS SUGGESTS)
      list(JOIN arg_${field} ", " CPACK_DEBIAN_${upper}_PACKAGE_${field})
    endforeach()
    if(arg_ARCHITECTURE)
      set(CPACK_DEBIAN_${upper}_PACKAGE_ARCHITECTURE ${arg_ARCHITECTURE})
    endif()
    foreach(file IN ITEMS conffiles postinst postrm prerm)
      if(EXISTS "${folder}/${file}")
        list(APPEND CPACK_DEBIAN_${upper}_PACKAGE_CONTROL_EXTRA "${folder}/${file}")
      endif()
    endforeach()
  endif()
endmacro()

get_target_property(abi_version lightwell_c SOVERSION)
set(library_package liblightwell${abi_version})

lightwell_debian_package(lightwelld daemon
  SECTION video
  DEPENDS "systemd | systemd-standalone-sysusers | systemd-sysusers"
  RECOMMENDS avahi-daemon
  DESCRIPTION
    "light probe for augmented reality, daemon"
    "lightwelld turns the frames of a fisheye or 360 degree camera, or of a camera"
    "with a printed marker in view, into a compact description of the light, and"
    "publishes it by gRPC, WebSocket, MQTT and USB."
    "."
    "The service is not enabled by installation: first edit"
    "/etc/lightwell/probe.textproto, then: systemctl enable --now lightwelld")
if("daemon" IN_LIST CPACK_COMPONENTS_ALL)
  install(FILES "${PROJECT_SOURCE_DIR}/firmware/app/service/probe.textproto"
          DESTINATION /etc/lightwell COMPONENT daemon-debian EXCLUDE_FROM_ALL)
endif()

# The SDK loads libavahi-client when it looks for probes.
set(discovery_recommends)
if(AVAHI_CLIENT_FOUND)
  set(discovery_recommends libavahi-client3 avahi-daemon)
endif()

lightwell_debian_package(${library_package} library
  SECTION libs
  RECOMMENDS ${discovery_recommends}
  SUGGESTS "lightwell-tools (= ${package_version})"
  DESCRIPTION
    "light probe for augmented reality, shared library"
    "liblightwell connects to light probes, and answers how a point is lit:"
    "irradiance at a normal, radiance from a direction, lights, cube maps, each"
    "with validity, age and error bound. This is its C ABI.")
if("library" IN_LIST CPACK_COMPONENTS_ALL)
  # Of other packages' dependencies: a minor version of the ABI adds functions.
  file(WRITE "${package_documents}/shlibs" "liblightwell ${abi_version} ${library_package} (>= ${package_version})\n")
  file(WRITE "${package_documents}/triggers" "activate-noawait ldconfig\n")
  string(TOUPPER ${library_package} upper)
  list(APPEND CPACK_DEBIAN_${upper}_PACKAGE_CONTROL_EXTRA "${package_documents}/shlibs" "${package_documents}/triggers")
endif()

# What the static libraries were built with, as lightwellConfig.cmake looks for it. Python runs unity/make_package.
set(development_needs pkg-config libprotobuf-dev libhwy-dev python3:any)
foreach(pair IN ITEMS "LIGHTWELL_WITH_GRPC libgrpc++-dev" "LIGHTWELL_WITH_GRPC protobuf-compiler-grpc"
                      "OPENSSL_FOUND libssl-dev" "LIBUSB_FOUND libusb-1.0-0-dev" "LIBWEBSOCKETS_FOUND libwebsockets-dev"
                      "LIBMOSQUITTO_FOUND libmosquitto-dev")
  string(REPLACE " " ";" pair "${pair}")
  list(GET pair 0 condition)
  if(${condition})
    list(GET pair 1 needed)
    list(APPEND development_needs ${needed})
  endif()
endforeach()
lightwell_debian_package(liblightwell-dev development
  SECTION libdevel
  DEPENDS "${library_package} (= ${package_version})" ${development_needs}
  SUGGESTS cmake libglm-dev libceres-dev libembree-dev libopencv-dev
  DESCRIPTION
    "light probe for augmented reality, development files"
    "Headers and static libraries of the C++ SDK, with its CMake package, the C ABI"
    "with its pkg-config file, and the messages as .proto files."
    "."
    "/usr/share/lightwell has the sources for C# and Unity, and the npm package.")

lightwell_debian_package(lightwell-tools tools
  SECTION video
  DEPENDS "${library_package} (= ${package_version})"
  RECOMMENDS "python3" "python3-matplotlib" ${discovery_recommends}
  DESCRIPTION
    "light probe for augmented reality, tools"
    "lightwell shows, queries, records and configures light probes."
    "lightwell-calibrate calibrates cameras, lightwell-estimate estimates the light"
    "of pictures, lightwell-eval measures accuracy, lightwell_plot.py draws charts."
    "Where they were built: ar_viewer draws virtual objects in a probe's light, and"
    "an OpenXR API layer gives applications XR_ANDROID_light_estimation;"
    "lightwell-field and a module for liblightwell have light between probes."
    "."
    "A udev rule lets users at this machine open a probe on a USB cable.")
if("tools" IN_LIST CPACK_COMPONENTS_ALL)
  # The host's rule, in effect; share/lightwell/udev has it for installations below another prefix.
  install(FILES "${PROJECT_BINARY_DIR}/host_sdk/70-lightwell.rules"
          DESTINATION lib/udev/rules.d COMPONENT tools-debian EXCLUDE_FROM_ALL)
endif()

lightwell_debian_package(python3-lightwell python
  SECTION python
  ARCHITECTURE all
  DEPENDS "python3:any" "python3-numpy" "${library_package} (= ${package_version})"
  DESCRIPTION
    "light probe for augmented reality, Python package"
    "Connects to light probes, and answers how points are lit, with NumPy arrays.")

if(components)
  message(FATAL_ERROR "cmake/packaging.cmake: no package is made of the install component(s) ${components}: give the install "
                      "rules one of the components that cmake/install.cmake lists")
endif()
include(CPack)
