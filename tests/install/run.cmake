# Installs the build into a new prefix, and configures, builds and runs an application against that prefix
# alone.
cmake_minimum_required(VERSION 3.25)
set(prefix "${WORK}/prefix")
set(build "${WORK}/consumer")
file(REMOVE_RECURSE "${WORK}")

function(run)
  execute_process(COMMAND ${ARGV} COMMAND_ERROR_IS_FATAL ANY)
endfunction()

run("${CMAKE_COMMAND}" --install "${BUILD}" --prefix "${prefix}")

# The package must not contain paths of this machine's source or build tree.
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

# The package contains the headers of the SDK, and none that only firmware includes.
file(GLOB headers RELATIVE "${SOURCE}/proto/firmware/include" "${SOURCE}/proto/firmware/include/lightwell/*.hpp")
foreach(header IN LISTS headers)
  if(EXISTS "${prefix}/include/${header}")
    message(FATAL_ERROR "${header}, which only firmware includes, was installed")
  endif()
endforeach()

# Marker bodies for lightwelld --body must be installed unchanged.
if(BODIES)
  file(GLOB names RELATIVE "${BODIES}" "${BODIES}/*.textproto")
  if(NOT names)
    message(FATAL_ERROR "no bodies in ${BODIES}")
  endif()
  foreach(name IN LISTS names)
    run("${CMAKE_COMMAND}" -E compare_files "${BODIES}/${name}" "${prefix}/share/lightwell/bodies/${name}")
  endforeach()
endif()

run("${CMAKE_COMMAND}" -S "${CONSUMER}" -B "${build}" -G "${GENERATOR}"
    "-DCMAKE_PREFIX_PATH=${prefix}" "-DCMAKE_CXX_COMPILER=${COMPILER}" "-DCMAKE_CXX_FLAGS=${FLAGS}"
    -DCMAKE_FIND_USE_PACKAGE_REGISTRY=OFF)
# The test must not find another Lightwell on this machine.
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

# Programs of an SDK without gRPC do not load it, and say how to get it.
if(WITHOUT_GRPC)
  set(tool "${prefix}/bin/lightwell")
  file(GLOB_RECURSE library "${prefix}/*/liblightwell.so")
  foreach(program IN ITEMS "${build}/consumer" "${tool}" ${library})
    execute_process(COMMAND ldd "${program}" OUTPUT_VARIABLE libraries COMMAND_ERROR_IS_FATAL ANY)
    if(libraries MATCHES "libgrpc|libabsl")
      message(FATAL_ERROR "${program} loads gRPC:\n${libraries}")
    endif()
  endforeach()
  foreach(command IN ITEMS "info grpc://127.0.0.1:1" "info grpcs://127.0.0.1:1" "pair grpcs://127.0.0.1:1 --code 123456")
    separate_arguments(arguments UNIX_COMMAND "${command}")
    execute_process(COMMAND "${tool}" ${arguments} RESULT_VARIABLE code ERROR_VARIABLE error)
    if(NOT code EQUAL 4 OR NOT error MATCHES "127.0.0.1:1: this SDK was built without gRPC.*LIGHTWELL_WITH_GRPC=ON")
      message(FATAL_ERROR "lightwell ${command} ended with ${code} and printed '${error}'")
    endif()
  endforeach()
endif()

# Each manifest of the OpenXR layer names the library by a relative path, and that finds liblightwell.so beside it.
if(OPENXR_LAYER)
  foreach(kind IN ITEMS explicit implicit)
    set(folder "${prefix}/share/openxr/1/api_layers/${kind}.d")
    file(READ "${folder}/XrApiLayer_lightwell_light_estimation.json" manifest)
    string(JSON library GET "${manifest}" api_layer library_path)
    execute_process(COMMAND ldd "${folder}/${library}" OUTPUT_VARIABLE libraries COMMAND_ERROR_IS_FATAL ANY)
    if(IS_ABSOLUTE "${library}" OR NOT libraries MATCHES "liblightwell[^\n]* => ${prefix}/")
      message(FATAL_ERROR "${folder}: ${library} loads:\n${libraries}")
    endif()
  endforeach()
endif()

if(NOT C_CONSUMER)
  return()
endif()

# The C ABI: by CMake's component and by pkg-config, each with only a C compiler.
set(build "${WORK}/c_consumer")
run("${CMAKE_COMMAND}" -S "${C_CONSUMER}" -B "${build}" -G "${GENERATOR}"
    "-DCMAKE_PREFIX_PATH=${prefix}" "-DCMAKE_C_COMPILER=${C_COMPILER}" "-DCMAKE_C_FLAGS=${FLAGS}"
    -DCMAKE_FIND_USE_PACKAGE_REGISTRY=OFF)
run("${CMAKE_COMMAND}" --build "${build}")

file(GLOB_RECURSE pc "${prefix}/*/lightwell.pc")
file(READ "${pc}" text)
if(text MATCHES "${SOURCE}|${BUILD}")
  message(FATAL_ERROR "${pc} names a tree of this machine")
endif()
cmake_path(GET pc PARENT_PATH pc_folder)
set(ENV{PKG_CONFIG_PATH} "${pc_folder}")
execute_process(COMMAND pkg-config --cflags --libs lightwell OUTPUT_VARIABLE flags COMMAND_ERROR_IS_FATAL ANY)
separate_arguments(flags UNIX_COMMAND "${flags} ${FLAGS}")
run("${C_COMPILER}" -std=c99 -o "${WORK}/by_pkg_config" "${C_CONSUMER}/main.c" ${flags})

file(GLOB_RECURSE library "${prefix}/*/liblightwell.so")
cmake_path(GET library PARENT_PATH library_folder)
# Python finds the library of its own prefix.
if(PYTHON)
  set(ENV{PYTHONPATH} "${prefix}/lib/python3/dist-packages")
  execute_process(COMMAND "${PYTHON}" -B -c "import lightwell; print('lightwell', lightwell.__version__, lightwell.__file__)"
                  OUTPUT_VARIABLE output COMMAND_ERROR_IS_FATAL ANY)
  string(STRIP "${output}" output)
  if(NOT output MATCHES "^lightwell ${VERSION} ${prefix}/")
    message(FATAL_ERROR "Python printed '${output}'")
  endif()
endif()

set(ENV{LD_LIBRARY_PATH} "${library_folder}")
foreach(program IN ITEMS "${build}/c_consumer" "${WORK}/by_pkg_config")
  execute_process(COMMAND "${program}" OUTPUT_VARIABLE output COMMAND_ERROR_IS_FATAL ANY)
  string(STRIP "${output}" output)
  if(NOT output STREQUAL "lightwell ${VERSION}")
    message(FATAL_ERROR "${program} printed '${output}', not 'lightwell ${VERSION}'")
  endif()
endforeach()
