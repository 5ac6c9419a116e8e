# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
cmake_policy(PUSH)
cmake_policy(VERSION 3.20...3.25)

# piko_add_pipeline(<target> SOURCES <file>... [PIPES <name>...]
#                   [CPU <name>[,<name>...]] [TUNED <file>]
#                   [OPTIONS <option>...])
#
# Compiles pipelines ahead of time and links them into a target, which may then
# include a header for each. Of one source the PIPES are compiled, each with the
# header <name>.h. Without PIPES each source has one pipeline, and a.piko.cpp
# the header a.h. They are compiled again when a file changes that they include.
#
# CPU      the processor to compile for: as clang names them, or native
#          (x86-64-v3); of several the last runs that fits the machine
# TUNED    what piko-tune chose for the pipeline, of which there is one then;
#          relative to the folder of the source, as SOURCES
# OPTIONS  further options of pikoc, such as -I<folder> and -D<name>; it runs in
#          the build folder, so paths are absolute
#
# Where the package has the runtime alone, as for another architecture, PIKO_PIKOC is a
# pikoc that runs on the machine that builds (the one in PATH).
function(piko_add_pipeline target)
  cmake_parse_arguments(PARSE_ARGV 1 ARG "" "CPU;TUNED" "SOURCES;PIPES;OPTIONS")
  if(ARG_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "piko_add_pipeline: unexpected '${ARG_UNPARSED_ARGUMENTS}'")
  endif()
  if(NOT TARGET ${target})
    message(FATAL_ERROR "piko_add_pipeline: there is no target '${target}'")
  endif()
  list(LENGTH ARG_SOURCES count)
  if(count EQUAL 0 OR (ARG_PIPES AND NOT count EQUAL 1))
    message(FATAL_ERROR
      "piko_add_pipeline: expected SOURCES, and only one of them with PIPES")
  endif()
  if(ARG_CPU)
    list(APPEND ARG_OPTIONS --cpu=${ARG_CPU})
  endif()
  if(ARG_TUNED)
    list(LENGTH ARG_PIPES pipes)
    if(count GREATER 1 OR pipes GREATER 1)
      message(FATAL_ERROR
        "piko_add_pipeline: expected one pipeline with TUNED")
    endif()
    get_filename_component(tuned ${ARG_TUNED} ABSOLUTE)
    list(APPEND ARG_OPTIONS --tuned=${tuned})
  endif()

  if(TARGET Piko::pikoc)
    set(PIKO_PIKOC Piko::pikoc)
  else()
    find_program(PIKO_PIKOC pikoc DOC "Piko's compiler, for this machine")
    if(NOT PIKO_PIKOC)
      message(FATAL_ERROR "piko_add_pipeline: expected pikoc; set PIKO_PIKOC to it")
    endif()
  endif()
  if(CMAKE_CROSSCOMPILING)
    list(APPEND ARG_OPTIONS --arch=${CMAKE_SYSTEM_PROCESSOR})
  endif()

  set(folder ${CMAKE_CURRENT_BINARY_DIR}/${target}.pipelines)
  foreach(source ${ARG_SOURCES})
    get_filename_component(source ${source} ABSOLUTE)
    if(ARG_PIPES)
      foreach(pipe ${ARG_PIPES})
        _piko_compile(${target} ${folder} ${source} ${pipe}
                      --pipe=${pipe} ${ARG_OPTIONS})
      endforeach()
    else()
      get_filename_component(name ${source} NAME)
      string(REGEX REPLACE "(\\.piko)?\\.[^.]*$" "" name ${name})
      _piko_compile(${target} ${folder} ${source} ${name} ${ARG_OPTIONS})
    endif()
  endforeach()
  target_include_directories(${target} PRIVATE ${folder})
  target_link_libraries(${target} PRIVATE Piko::runtime ${PIKO_OPENMP_RUNTIME})
endfunction()

# One object with its header; the rest are options of pikoc.
function(_piko_compile target folder source name)
  file(MAKE_DIRECTORY ${folder})
  set(object ${folder}/${name}.o)
  set(header ${folder}/${name}.h)
  add_custom_command(
    OUTPUT ${object} ${header}
    COMMAND ${PIKO_PIKOC} ${source} -o ${object} --header=${header}
            --depfile=${object}.d ${ARGN}
    DEPENDS ${source} ${PIKO_PIKOC}
    DEPFILE ${object}.d
    COMMENT "Compiling pipeline ${name}"
    VERBATIM)
  set_source_files_properties(${object} PROPERTIES
    EXTERNAL_OBJECT TRUE GENERATED TRUE)
  target_sources(${target} PRIVATE ${object} ${header})
endfunction()

cmake_policy(POP)
