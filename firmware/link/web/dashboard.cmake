# The files of the dashboard as part of the program: the page, the TypeScript SDK compiled by tsc, and three.js.
# Sets dashboard_source (a C++ file) and dashboard_summary (for LIGHTWELL_FEATURES). Without tsc there is no page, because
# the SDK is its client. Without three.js the page draws its spheres on a plain canvas.
set(dashboard_source "${CMAKE_CURRENT_BINARY_DIR}/dashboard_files.cpp")
set(served) # The path below the page's address, then the file; in turns.
if(LIGHTWELL_TSC)
  set(page "${CMAKE_CURRENT_SOURCE_DIR}/web/dashboard")
  file(GLOB files CONFIGURE_DEPENDS RELATIVE "${page}" "${page}/*")
  list(FILTER files EXCLUDE REGEX "[.]md$")
  foreach(file IN LISTS files)
    list(APPEND served "${file}" "${page}/${file}")
  endforeach()

  set(sdk "${PROJECT_SOURCE_DIR}/host_sdk/bindings/typescript")
  file(GLOB modules CONFIGURE_DEPENDS "${sdk}/src/*.ts")
  set(compiled)
  foreach(module IN LISTS modules)
    get_filename_component(name "${module}" NAME_WE)
    list(APPEND compiled "${CMAKE_CURRENT_BINARY_DIR}/dashboard/sdk/${name}.js")
    list(APPEND served "sdk/${name}.js" "${CMAKE_CURRENT_BINARY_DIR}/dashboard/sdk/${name}.js")
  endforeach()
  add_custom_command(OUTPUT ${compiled}
    COMMAND ${LIGHTWELL_TSC} -p "${sdk}" --removeComments --declaration false
            --outDir "${CMAKE_CURRENT_BINARY_DIR}/dashboard/sdk"
    # A sixth of the compiled bytes is indentation.
    COMMAND sed -i "s/^ *//" ${compiled}
    # tsc leaves the time of a file alone whose content stays the same.
    COMMAND "${CMAKE_COMMAND}" -E touch ${compiled}
    DEPENDS ${modules} "${sdk}/tsconfig.json"
    COMMENT "Compiling the TypeScript SDK for the dashboard" VERBATIM)

  set(load "export const three = null;\n")
  set(dashboard_summary "dashboard: built, without three.js (libjs-three): 2-D spheres")
  if(LIGHTWELL_THREE)
    set(load "import \"./three.min.js\";\nexport const { THREE: three } = globalThis;\n")
    list(APPEND served "three/three.min.js" "${LIGHTWELL_THREE}")
    set(dashboard_summary "dashboard: built, with three.js")
  endif()
  file(CONFIGURE OUTPUT dashboard/three/load.js CONTENT "${load}" @ONLY)
  list(APPEND served "three/load.js" "${CMAKE_CURRENT_BINARY_DIR}/dashboard/three/load.js")
else()
  set(dashboard_summary "dashboard: left out, tsc (node-typescript) was not found")
endif()

set(entries)
set(symbols)
set(assembly)
set(sources)
list(LENGTH served length)
set(number 0)
while(number LESS length)
  math(EXPR next "${number} + 1")
  list(GET served ${number} path)
  list(GET served ${next} file)
  set(symbol "lightwell_dashboard_${number}")
  string(APPEND assembly "    \".global ${symbol}, ${symbol}_end\\n.hidden ${symbol}, ${symbol}_end\\n\"\n"
    "    \"${symbol}: .incbin \\\"${file}\\\"\\n${symbol}_end: .byte 0\\n\"\n")
  string(APPEND symbols "extern const std::byte ${symbol}[], ${symbol}_end[];\n")
  string(APPEND entries "      {\"/${path}\", {${symbol}, ${symbol}_end}},\n")
  list(APPEND sources "${file}")
  math(EXPR number "${number} + 2")
endwhile()
configure_file(web/dashboard_files.cpp.in "${dashboard_source}" @ONLY)
set_source_files_properties("${dashboard_source}" PROPERTIES OBJECT_DEPENDS "${sources}")
