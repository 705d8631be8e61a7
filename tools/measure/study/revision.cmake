# cmake -DOUTPUT=file -P revision.cmake: writes the source's commit as a C++ file, if it is another one
# than the file has. `git archive` writes it into revision.txt; a checkout has it from git.
cmake_minimum_required(VERSION 3.21)

file(STRINGS ${CMAKE_CURRENT_LIST_DIR}/revision.txt revision LIMIT_COUNT 1)
if(NOT revision MATCHES "^[0-9a-f]+$")
  execute_process(COMMAND git -C ${CMAKE_CURRENT_LIST_DIR} describe --always --dirty --abbrev=40 --exclude=*
                  OUTPUT_VARIABLE revision RESULT_VARIABLE failed ERROR_QUIET
                  OUTPUT_STRIP_TRAILING_WHITESPACE)
  if(failed)
    set(revision unknown)
  endif()
endif()
set(text "#include \"tools/measure/study/revision.h\"

const char* const postchain::study::kSourceRevision = \"${revision}\";
")
set(before "")
if(EXISTS ${OUTPUT})
  file(READ ${OUTPUT} before)
endif()
if(NOT before STREQUAL text)
  file(WRITE ${OUTPUT} "${text}")
endif()
