# Writes version_stamp.h where it is not already as it should be. Run as a script at build time.
set(git unknown)
if(GIT)
  execute_process(COMMAND ${GIT} --no-optional-locks -C ${SOURCE} describe --always --abbrev=12
                  OUTPUT_VARIABLE answer OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE failed)
  # What a reproduction writes changes no program: it would do all its runs again after an interruption.
  execute_process(COMMAND ${GIT} --no-optional-locks -C ${SOURCE} diff --quiet HEAD -- . :!results
                  OUTPUT_QUIET ERROR_QUIET RESULT_VARIABLE changed)
  if(NOT failed)
    set(git ${answer})
    if(changed)
      string(APPEND git "-dirty")
    endif()
  endif()
endif()
string(CONCAT text
  "#pragma once\n"
  "#define CONTACTBENCH_VERSION \"${VERSION}\"\n"
  "#define CONTACTBENCH_GIT \"${git}\"\n"
  "#define CONTACTBENCH_COMPILER \"${COMPILER}\"\n"
  "#define CONTACTBENCH_FLAGS \"${FLAGS}\"\n"
  "#define CONTACTBENCH_SUITESPARSE \"${SUITESPARSE}\"\n")
set(before "")
if(EXISTS ${OUTPUT})
  file(READ ${OUTPUT} before)
endif()
if(NOT text STREQUAL before)
  file(WRITE ${OUTPUT} "${text}")
endif()
