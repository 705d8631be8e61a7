# cmake -DROOT=dir -DPAGE=file -DOUTPUT=file -P bundle.cmake
#
# Writes a page from its template, a file of ROOT:
#   {{text FILE}}       the file's text
#   {{modules FILE}}    the ES module and all that it imports, as one classic script: modules cannot be
#                       imported from file://. Each becomes a function that returns its exports;
#                       import { a } from "./b.js" becomes const { a } = ..., and a circle is an error.
# A page without marks is copied. Modules with default exports, renaming or imports for effects
# are refused.
cmake_minimum_required(VERSION 3.21)

set(done "")      # files whose modules are in `bundle`
set(bundle "")

function(read_module file open)
  if(file IN_LIST open)
    list(JOIN open " imports " way)
    message(FATAL_ERROR "a circle of modules: ${way} imports ${file}")
  endif()
  if(file IN_LIST done)
    return()
  endif()
  list(APPEND open ${file})
  file(READ ${ROOT}/${file} text)
  string(REGEX MATCHALL "import {[^}]*} from \"[^\"]*\"" imports "${text}")
  cmake_path(GET file PARENT_PATH folder)
  foreach(line IN LISTS imports)
    string(REGEX REPLACE ".* from \"([^\"]*)\"" "\\1" target "${line}")
    cmake_path(SET path NORMALIZE ./${folder}/${target})
    read_module(${path} "${open}")
    string(MAKE_C_IDENTIFIER ${path} id)
    string(REPLACE " from \"${target}\"" " = ${id}" text "${text}")
  endforeach()
  string(REGEX REPLACE "(^|\n)import {" "\\1const {" text "${text}")

  set(names "")
  string(REGEX MATCHALL "\nexport (async )?(function|const|let|class) [A-Za-z_$0-9]+" exports
         "\n${text}")
  foreach(line IN LISTS exports)
    string(REGEX REPLACE ".* " "" name "${line}")
    list(APPEND names ${name})
  endforeach()
  list(JOIN names ", " names)
  string(REGEX REPLACE "(^|\n)export (async |function|const|let|class)" "\\1\\2" text "${text}")
  string(REGEX REPLACE "(^|\n)[ \t]*//[^\n]*" "\\1" text "${text}")
  string(REGEX REPLACE "\n\n+" "\n" text "${text}")
  if(text MATCHES "(^|\n)(import|export)[ {]" OR text MATCHES "</script")
    message(FATAL_ERROR "${file}: cannot be bundled: '${CMAKE_MATCH_0}'")
  endif()
  string(MAKE_C_IDENTIFIER ${file} id)
  set(bundle "${bundle}const ${id} = (() => {${text}return { ${names} };\n})();\n" PARENT_SCOPE)
  set(done "${done};${file}" PARENT_SCOPE)
endfunction()

file(READ ${ROOT}/${PAGE} page)
string(REGEX MATCHALL "{{[a-z]+ [^}]+}}" marks "${page}")
foreach(mark IN LISTS marks)
  string(REGEX REPLACE "{{([a-z]+) ([^}]+)}}" "\\1;\\2" words "${mark}")
  list(GET words 0 what)
  list(GET words 1 file)
  if(what STREQUAL "text")
    file(READ ${ROOT}/${file} text)
  elseif(what STREQUAL "modules")
    read_module(${file} "")
    set(text "\"use strict\";\n(() => {\n${bundle}})();\n")
  else()
    message(FATAL_ERROR "${PAGE}: unknown mark ${mark}")
  endif()
  string(REPLACE "${mark}" "${text}" page "${page}")
endforeach()
file(WRITE ${OUTPUT} "${page}")
