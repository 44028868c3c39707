# The page of `graze report` and `graze view`: analysis/web becomes one HTML file, which becomes a C++ source. npm works in
# the build tree only.
option(GRAZE_REPORT "Build the pages of graze report and graze view, for which Node.js and npm are needed" ON)
set(page_source ${CMAKE_BINARY_DIR}/generated/page_template.cpp)

if(GRAZE_REPORT)
  find_program(GRAZE_NODE NAMES node nodejs)
  find_program(GRAZE_NPM npm)
  if(NOT GRAZE_NODE OR NOT GRAZE_NPM)
    message(FATAL_ERROR "graze report needs Node.js and npm to be built, and they are not there. Install them (jobs/install "
      "does), or configure with -DGRAZE_REPORT=OFF: graze then refuses to write pages, and says why.")
  endif()
  set(web ${PROJECT_SOURCE_DIR}/analysis/web)
  set(web_build ${CMAKE_BINARY_DIR}/web)
  file(GLOB web_sources CONFIGURE_DEPENDS ${web}/src/*)
  add_custom_command(OUTPUT ${web_build}/installed
    COMMAND ${CMAKE_COMMAND} -E make_directory ${web_build}
    COMMAND ${CMAKE_COMMAND} -E copy ${web}/package.json ${web}/package-lock.json ${web_build}
    COMMAND ${CMAKE_COMMAND} -E chdir ${web_build} ${GRAZE_NPM} ci --ignore-scripts --no-audit --no-fund --loglevel=error
    COMMAND ${CMAKE_COMMAND} -E touch ${web_build}/installed
    DEPENDS ${web}/package.json ${web}/package-lock.json
    COMMENT "Fetching what the report's page is made of" VERBATIM)
  add_custom_command(OUTPUT ${page_source}
    COMMAND ${GRAZE_NODE} ${web}/build.mjs ${web}/src ${web_build} ${page_source}
    DEPENDS ${web_build}/installed ${web}/build.mjs ${web_sources}
    COMMENT "Bundling the report's page" VERBATIM)
else()
  file(CONFIGURE OUTPUT ${page_source} @ONLY CONTENT
    "#include \"jobs/cli/page.h\"\nnamespace graze {\nconst PageTemplate& page_template() {\n  static const PageTemplate none;\n  return none;\n}\n}\n")
endif()
target_sources(graze_jobs PRIVATE ${page_source})
