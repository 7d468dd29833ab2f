# Functions that define the targets of this project. Folders call them and set no compiler flags themselves.

if(NOT CMAKE_CXX_COMPILER_LAUNCHER)
  find_program(LIGHTWELL_CCACHE ccache)
  if(LIGHTWELL_CCACHE)
    # Paths in the tree are relative in the cache, so that a second clone reuses what the first one compiled.
    set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_BASEDIR=${PROJECT_SOURCE_DIR} CCACHE_NOHASHDIR=1
                                    ${LIGHTWELL_CCACHE})
  endif()
endif()

set(CMAKE_CXX_EXTENSIONS OFF)
# Applications and language bindings link the SDK's static libraries into shared libraries.
set(CMAKE_POSITION_INDEPENDENT_CODE ON)

add_library(lightwell_options INTERFACE)
target_compile_features(lightwell_options INTERFACE cxx_std_20)
target_compile_options(lightwell_options INTERFACE
  -Wall -Wextra -Wpedantic -Wconversion -Wshadow -Wnon-virtual-dtor
  # clang includes -Wsign-conversion in -Wconversion and GCC does not: without it both give the same warnings.
  -Wno-sign-conversion
  # GCC 12 for aarch64 inlines more and then reports an empty std::optional as uninitialised memory
  # (GCC bug 80635); the native build keeps the warning. psabi: a note that GCC 9 and later versions
  # pass some arguments differently.
  $<$<AND:$<BOOL:${CMAKE_CROSSCOMPILING}>,$<CXX_COMPILER_ID:GNU>>:-Wno-maybe-uninitialized>
  $<$<BOOL:${CMAKE_CROSSCOMPILING}>:-Wno-psabi>
  # In a unity build GCC warns as if the anonymous namespaces of source files stood in a header.
  $<$<BOOL:${CMAKE_UNITY_BUILD}>:-Wno-subobject-linkage>
  $<$<BOOL:${LIGHTWELL_WERROR}>:-Werror>
  # GCC fuses a*b+c wherever the processor can, so the same source would round differently on the
  # ARM board, on a PC, and for each -march of a vectorised kernel. The flag applies to libraries, tests,
  # reference implementations and benchmarks alike: a figure measured with floating-point flags other
  # than the firmware's would not be about the firmware.
  -ffp-contract=off)

if(LIGHTWELL_SANITIZE STREQUAL "address")
  # An application that links the instrumented SDK must be built with the same flags.
  set(LIGHTWELL_SANITIZE_FLAGS -fsanitize=address,undefined)
  target_compile_options(lightwell_options INTERFACE -fno-sanitize-recover=undefined)
  target_compile_definitions(lightwell_options INTERFACE _GLIBCXX_ASSERTIONS)
elseif(LIGHTWELL_SANITIZE STREQUAL "thread")
  set(LIGHTWELL_SANITIZE_FLAGS -fsanitize=thread)
elseif(LIGHTWELL_SANITIZE)
  message(FATAL_ERROR "LIGHTWELL_SANITIZE is '${LIGHTWELL_SANITIZE}': it must be empty, address or thread")
endif()
if(LIGHTWELL_SANITIZE)
  target_compile_options(lightwell_options INTERFACE
    ${LIGHTWELL_SANITIZE_FLAGS} -fno-omit-frame-pointer)
  target_link_options(lightwell_options INTERFACE ${LIGHTWELL_SANITIZE_FLAGS})
endif()

# lightwell_top_folder(<variable>): the top-level folder (proto, firmware, ...) of the caller's CMakeLists.txt.
function(lightwell_top_folder result)
  file(RELATIVE_PATH path "${PROJECT_SOURCE_DIR}" "${CMAKE_CURRENT_SOURCE_DIR}")
  string(REGEX MATCH "^[^/]*" top_folder "${path}")
  set(${result} "${top_folder}" PARENT_SCOPE)
endfunction()

# lightwell_library(<name> SOURCES <file>... [HEADERS <file>...] [PUBLIC <library>...]
#                   [PRIVATE <library>...] [INCLUDE_ROOT <dir>])
# A static library or, without SOURCES, a header-only one. PUBLIC are the libraries that its headers
# include, PRIVATE those that only its sources include. INCLUDE_ROOT is the folder that #include lines are
# relative to: by default <top folder>/include for proto and host_sdk, and the top folder elsewhere: for
# example <lightwell/probe.hpp> and "imaging/frame.hpp". The sources of proto and host_sdk may also include
# relative to <top folder>/src.
function(lightwell_library name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "INCLUDE_ROOT" "SOURCES;HEADERS;PUBLIC;PRIVATE")
  lightwell_refuse_unparsed(${name} "${arg_UNPARSED_ARGUMENTS}")
  lightwell_top_folder(top_folder)
  set(public_root "${PROJECT_SOURCE_DIR}/${top_folder}")
  set(private_root)
  if(top_folder MATCHES "^(proto|host_sdk)$")
    set(private_root "${public_root}/src")
    string(APPEND public_root "/include")
  endif()
  if(arg_INCLUDE_ROOT)
    set(public_root "${arg_INCLUDE_ROOT}")
  endif()
  set(kind STATIC)
  set(visible PUBLIC)
  if(NOT arg_SOURCES)
    set(kind INTERFACE)
    set(visible INTERFACE)
  endif()
  add_library(${name} ${kind} ${arg_SOURCES} ${arg_HEADERS})
  target_compile_features(${name} ${visible} cxx_std_20)
  # BUILD_INTERFACE: the installed package contains neither the paths of this tree nor its warning flags.
  target_include_directories(${name} ${visible} $<BUILD_INTERFACE:${public_root}>)
  target_link_libraries(${name} ${visible} ${arg_PUBLIC})
  if(arg_SOURCES)
    target_include_directories(${name} PRIVATE ${private_root})
    target_link_libraries(${name} PRIVATE $<BUILD_INTERFACE:lightwell_options> ${arg_PRIVATE})
  endif()
endfunction()

# lightwell_executable(<name> SOURCES <file>... [LIBRARIES <library>...])
# Builds the program into <build>/bin. The caller installs it where that is wanted.
function(lightwell_executable name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "SOURCES;LIBRARIES")
  lightwell_refuse_unparsed(${name} "${arg_UNPARSED_ARGUMENTS}")
  add_executable(${name} ${arg_SOURCES})
  target_link_libraries(${name} PRIVATE lightwell_options ${arg_LIBRARIES})
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}/bin")
endfunction()

# lightwell_test(<name> SOURCES <file>... LABELS <label>... [LIBRARIES <library>...]
#                [TIMEOUT <seconds>] [COST <seconds>] [ENVIRONMENT <NAME=value>...])
# A Google Test program and one ctest of the same name. A test may include private headers: #include
# lines are relative to tests/, proto/src and host_sdk/src as well as to the folders of its LIBRARIES.
# The environment variable LIGHTWELL_PANORAMA_DIR is the folder of the panoramas. ctest starts the tests
# with the largest COST first (default: 10): the seconds that the test takes, times 1.5 if it mostly waits, so that
# waiting and computing tests overlap. The test also gets its folder below tests/ as a label (firmware/estimate), so that
# the tests of one folder can be selected.
function(lightwell_test name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "TIMEOUT;COST" "SOURCES;LIBRARIES;LABELS;ENVIRONMENT")
  lightwell_refuse_unparsed(${name} "${arg_UNPARSED_ARGUMENTS}")
  if(NOT arg_LABELS)
    message(FATAL_ERROR "lightwell_test(${name}): LABELS is missing: give the labels that select the test")
  endif()
  if(NOT arg_TIMEOUT)
    set(arg_TIMEOUT 120)
  endif()
  if(NOT arg_COST)
    set(arg_COST 10)
  endif()
  cmake_path(RELATIVE_PATH CMAKE_CURRENT_SOURCE_DIR BASE_DIRECTORY "${PROJECT_SOURCE_DIR}/tests"
             OUTPUT_VARIABLE folder)
  list(APPEND arg_LABELS "${folder}")
  list(REMOVE_DUPLICATES arg_LABELS)
  if(CMAKE_CROSSCOMPILING AND CMAKE_SYSTEM_PROCESSOR STREQUAL "aarch64")
    lightwell_emulated(${name})
  elseif(CMAKE_CROSSCOMPILING)
    # Each program starts Wine.
    math(EXPR arg_TIMEOUT "${arg_TIMEOUT} * 3")
  endif()
  add_executable(${name} ${arg_SOURCES})
  target_include_directories(${name} PRIVATE
    "${PROJECT_SOURCE_DIR}/tests" "${PROJECT_SOURCE_DIR}/proto/src"
    "${PROJECT_SOURCE_DIR}/host_sdk/src")
  target_link_libraries(${name} PRIVATE
    lightwell_options ${arg_LIBRARIES} GTest::gtest_main GTest::gmock)
  # The libraries under test keep their flags. -O1 shortens the compilation of the test's own sources.
  target_compile_options(${name} PRIVATE "$<$<CONFIG:RelWithDebInfo>:-O1>")
  add_test(NAME ${name} COMMAND ${name})
  set_tests_properties(${name} PROPERTIES
    LABELS "${arg_LABELS}" TIMEOUT ${arg_TIMEOUT} COST ${arg_COST}
    ENVIRONMENT "LIGHTWELL_PANORAMA_DIR=${LIGHTWELL_PANORAMA_DIR};${arg_ENVIRONMENT}")
endfunction()

# Part of lightwell_test, whose arg_TIMEOUT and arg_ENVIRONMENT it changes: an emulated processor is
# ten to fifty times slower, so the time limit is longer, and the Google Tests that
# tests/arm64/left_out.txt names are not run.
function(lightwell_emulated name)
  math(EXPR arg_TIMEOUT "${arg_TIMEOUT} * 5")
  set(list "${PROJECT_SOURCE_DIR}/tests/arm64/left_out.txt")
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${list}")
  file(STRINGS "${list}" left_out REGEX "^${name} ")
  if(left_out)
    list(TRANSFORM left_out REPLACE "^${name} +([^ ]+).*" "\\1")
    list(JOIN left_out ":" left_out)
    list(APPEND arg_ENVIRONMENT "GTEST_FILTER=-${left_out}")
  endif()
  set(arg_TIMEOUT ${arg_TIMEOUT} PARENT_SCOPE)
  set(arg_ENVIRONMENT "${arg_ENVIRONMENT}" PARENT_SCOPE)
endfunction()

# lightwell_proto_library(MESSAGES <name> IMPORT_ROOT <dir> PROTOS <file>...
#                         [SERVICES <name> SERVICE_PROTOS <file>...])
# Generates C++ into the build tree: the library MESSAGES from all PROTOS and the library SERVICES
# from SERVICE_PROTOS (which are among PROTOS); two, so that only the network links depend on gRPC.
# Paths are relative to IMPORT_ROOT, as in import lines and generated #include lines.
function(lightwell_proto_library)
  cmake_parse_arguments(PARSE_ARGV 0 arg
    "" "MESSAGES;SERVICES;IMPORT_ROOT" "PROTOS;SERVICE_PROTOS")
  lightwell_refuse_unparsed("${arg_MESSAGES}" "${arg_UNPARSED_ARGUMENTS}")
  cmake_path(ABSOLUTE_PATH arg_IMPORT_ROOT NORMALIZE)
  # Any file may import any other, so all are generated again when one changes: there are few.
  list(TRANSFORM arg_PROTOS PREPEND "${arg_IMPORT_ROOT}/" OUTPUT_VARIABLE all_protos)

  lightwell_generate(${arg_MESSAGES} .pb "" "${arg_PROTOS}")
  target_link_libraries(${arg_MESSAGES} PUBLIC protobuf::libprotobuf)
  if(arg_SERVICES)
    lightwell_generate(${arg_SERVICES} .grpc.pb
      "--plugin=protoc-gen-grpc=${LIGHTWELL_GRPC_CPP_PLUGIN}" "${arg_SERVICE_PROTOS}")
    target_link_libraries(${arg_SERVICES} PUBLIC ${arg_MESSAGES} gRPC::grpc++)
  endif()
endfunction()

# Part of lightwell_proto_library, whose arg_IMPORT_ROOT and all_protos it reads.
function(lightwell_generate name suffix plugin protos)
  # One folder per library, so that code that does not link the services cannot include their headers.
  set(folder "${PROJECT_BINARY_DIR}/generated/${name}")
  file(MAKE_DIRECTORY "${folder}")
  if(plugin)
    set(out --grpc_out)
  else()
    set(out --cpp_out)
  endif()
  set(sources)
  foreach(proto IN LISTS protos)
    string(REGEX REPLACE "\\.proto$" "${suffix}" stem "${folder}/${proto}")
    add_custom_command(
      OUTPUT "${stem}.cc" "${stem}.h"
      COMMAND protobuf::protoc ${plugin} "${out}=${folder}"
              "--proto_path=${arg_IMPORT_ROOT}" ${proto}
      DEPENDS ${all_protos}
      COMMENT "Generating ${proto} for ${name}"
      VERBATIM)
    list(APPEND sources "${stem}.cc" "${stem}.h")
  endforeach()
  add_library(${name} STATIC ${sources})
  # SYSTEM and -w suppress the warnings of generated code, which is not edited here.
  target_include_directories(${name} SYSTEM PUBLIC $<BUILD_INTERFACE:${folder}>)
  target_compile_features(${name} PUBLIC cxx_std_20)
  target_link_libraries(${name} PRIVATE $<BUILD_INTERFACE:lightwell_options>)
  target_compile_options(${name} PRIVATE -w)
  # The files that protoc generates define static objects of the same names.
  set_target_properties(${name} PROPERTIES UNITY_BUILD OFF)
endfunction()

# Stops at a misspelt keyword, which would otherwise be taken as a file name or be ignored.
function(lightwell_refuse_unparsed name unparsed)
  if(unparsed)
    message(FATAL_ERROR "${name}: unknown argument '${unparsed}'")
  endif()
endfunction()
