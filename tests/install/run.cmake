# Installs the build into a fresh prefix, and configures, builds and runs an application that knows
# of nothing but that prefix.
cmake_minimum_required(VERSION 3.25)
set(prefix "${WORK}/prefix")
set(build "${WORK}/consumer")
file(REMOVE_RECURSE "${WORK}")

function(run)
  execute_process(COMMAND ${ARGV} COMMAND_ERROR_IS_FATAL ANY)
endfunction()

run("${CMAKE_COMMAND}" --install "${BUILD}" --prefix "${prefix}")

# A path of this machine's source or build tree in the package works here and nowhere else.
file(GLOB_RECURSE package "${prefix}/*/lightwell*.cmake")
if(NOT package)
  message(FATAL_ERROR "no CMake package was installed under ${prefix}")
endif()
foreach(file IN LISTS package)
  file(READ "${file}" text)
  foreach(tree IN ITEMS "${SOURCE}/" "${BUILD}/")
    string(FIND "${text}" "${tree}" at)
    if(NOT at EQUAL -1)
      message(FATAL_ERROR "${file} names ${tree}")
    endif()
  endforeach()
endforeach()

run("${CMAKE_COMMAND}" -S "${CONSUMER}" -B "${build}" -G "${GENERATOR}"
    "-DCMAKE_PREFIX_PATH=${prefix}" "-DCMAKE_CXX_COMPILER=${COMPILER}" "-DCMAKE_CXX_FLAGS=${FLAGS}"
    -DCMAKE_FIND_USE_PACKAGE_REGISTRY=OFF)
# Another Lightwell on the machine must not be what was tested.
load_cache("${build}" READ_WITH_PREFIX found_ lightwell_DIR)
cmake_path(IS_PREFIX prefix "${found_lightwell_DIR}" NORMALIZE inside)
if(NOT inside)
  message(FATAL_ERROR "the consumer found ${found_lightwell_DIR}, not ${prefix}")
endif()
run("${CMAKE_COMMAND}" --build "${build}")

execute_process(COMMAND "${build}/consumer" OUTPUT_VARIABLE output COMMAND_ERROR_IS_FATAL ANY)
string(STRIP "${output}" output)
if(NOT output STREQUAL "lightwell ${VERSION}")
  message(FATAL_ERROR "the consumer printed '${output}', not 'lightwell ${VERSION}'")
endif()
