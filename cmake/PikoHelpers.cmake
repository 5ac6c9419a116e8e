# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception

# Flags that every target of the project is built with.
add_library(piko_options INTERFACE)
target_compile_options(piko_options INTERFACE
  "$<BUILD_INTERFACE:-Wall;-Wextra;-Wno-unused-parameter;-ffp-contract=off>")

if(PIKO_ENABLE_COMPILER)
  # What a target that uses LLVM, MLIR or Clang needs.
  add_library(piko_llvm INTERFACE)
  target_include_directories(piko_llvm SYSTEM INTERFACE ${LLVM_INCLUDE_DIRS} ${MLIR_INCLUDE_DIRS})
  target_include_directories(piko_llvm INTERFACE
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include>
    $<BUILD_INTERFACE:${PROJECT_BINARY_DIR}/include>
    $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  separate_arguments(PIKO_LLVM_DEFINITIONS NATIVE_COMMAND "${LLVM_DEFINITIONS}")
  target_compile_definitions(piko_llvm INTERFACE ${PIKO_LLVM_DEFINITIONS})
  if(CMAKE_BUILD_TYPE STREQUAL "Release")
    # It compiles in half of the time of -O3, and the compiler is as fast: what
    # takes its time are LLVM's libraries. PIKO_OPTIMIZATION: another level.
    set(level $<TARGET_PROPERTY:PIKO_OPTIMIZATION>)
    set(flags -O$<IF:$<STREQUAL:${level},>,1,${level}>)
  else()
    set(flags "SHELL:-include ${CMAKE_CURRENT_LIST_DIR}/LLVMStatistics.h")
  endif()
  target_compile_options(piko_llvm INTERFACE
    "$<BUILD_INTERFACE:$<$<COMPILE_LANGUAGE:CXX>:${flags}>>")
  if(NOT LLVM_ENABLE_RTTI)
    target_compile_options(piko_llvm INTERFACE $<$<COMPILE_LANGUAGE:CXX>:-fno-rtti>)
  endif()
  # As LLVM is, which no exception could leave. Tools catch those of the runtime.
  if(NOT LLVM_ENABLE_EH)
    set(PIKO_COMPILER_FLAGS $<$<COMPILE_LANGUAGE:CXX>:-fno-exceptions>)
  endif()
  target_link_libraries(piko_llvm INTERFACE
    ${PIKO_LLVM_PREFIX}/lib/libMLIR.so ${PIKO_LLVM_PREFIX}/lib/libLLVM.so)

  add_library(piko_clang INTERFACE)
  target_link_libraries(piko_clang INTERFACE piko_llvm ${PIKO_LLVM_PREFIX}/lib/libclang-cpp.so)
endif()

# Most of the time that a file of the compiler takes to compile goes into the
# headers of MLIR and of the dialect. Debug builds include LLVMStatistics.h first
# and do without.
option(PIKO_PRECOMPILE_HEADERS
  "Precompile the headers of LLVM, MLIR, Clang and the dialect" ON)
if(PIKO_PRECOMPILE_HEADERS AND PIKO_ENABLE_COMPILER
   AND CMAKE_CXX_COMPILER_ID STREQUAL "Clang" AND CMAKE_BUILD_TYPE STREQUAL "Release")
  set(PIKO_PRECOMPILES ON)
endif()

# piko_add_precompiled(<target> <header of this folder> [BASE target] [LINK libraries])
# A target that piko_use_precompiled takes a precompiled header from, on top of that of
# another such target, the base. ccache has none of it, which holds paths of this tree,
# and knows it by a checksum of what it is made of.
function(piko_add_precompiled target header)
  cmake_parse_arguments(ARG "" "BASE" "LINK" ${ARGN})
  add_library(${target} OBJECT ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/Precompiled.cpp)
  set_target_properties(${target} PROPERTIES CXX_COMPILER_LAUNCHER "${PIKO_COMPILER_LAUNCHER}")
  target_link_libraries(${target} PRIVATE piko_options ${ARG_LINK})
  target_compile_options(${target} PRIVATE
    ${PIKO_COMPILER_FLAGS} "SHELL:-Xclang -fno-pch-timestamp")
  if(ARG_BASE)
    set(folder ${CMAKE_CURRENT_BINARY_DIR}/CMakeFiles)
    set(base ${folder}/${ARG_BASE}.dir/cmake_pch.hxx.pch)
    target_compile_options(${target} PRIVATE "SHELL:-Xclang -include-pch -Xclang ${base}")
    set_source_files_properties(${folder}/${target}.dir/cmake_pch.hxx.cxx
      PROPERTIES OBJECT_DEPENDS ${base})
  endif()
  target_precompile_headers(${target} PRIVATE
    ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/${header})
  set(dialect ${PROJECT_SOURCE_DIR}/include/Piko/Dialect/Piko/IR)
  file(GLOB headers CONFIGURE_DEPENDS
    ${dialect}/*.h ${dialect}/*.td ${dialect}/Ops/*.td ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/Precompiled*.h)
  set(sum ${CMAKE_CURRENT_BINARY_DIR}/CMakeFiles/${target}.dir/cmake_pch.hxx.pch.sum)
  set(hash ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/HashHeaders.cmake)
  add_custom_command(OUTPUT ${sum}
    COMMAND ${CMAKE_COMMAND} -D OUT=${sum} -D
      "SALT=${header} ${CMAKE_CXX_COMPILER_VERSION} ${CMAKE_CXX_FLAGS} ${LLVM_PACKAGE_VERSION}"
      -P ${hash} ${headers}
    DEPENDS ${hash} ${headers} COMMENT "Hashing what ${header} includes" VERBATIM)
  add_custom_target(${target}_sum DEPENDS ${sum})
  add_dependencies(${target} PikoIncGen ${target}_sum)
endfunction()

function(piko_use_precompiled target from)
  if(PIKO_PRECOMPILES)
    target_compile_options(${target} PRIVATE "SHELL:-Xclang -fno-pch-timestamp")
    target_precompile_headers(${target} REUSE_FROM ${from})
  endif()
endfunction()

if(PIKO_PRECOMPILES)
  piko_add_precompiled(piko_precompiled_mlir PrecompiledMLIR.h LINK piko_llvm)
  piko_add_precompiled(piko_precompiled_clang PrecompiledClang.h
    BASE piko_precompiled_mlir LINK piko_clang)
endif()

# What two files include is compiled once, and so are the templates that both use.
option(PIKO_UNITE
  "Compile sixteen files of a library as one; off, a changed file is compiled alone" OFF)

set(PIKO_UNITE_FILES 16)

function(piko_unite target)
  set_target_properties(${target} PROPERTIES
    UNITY_BUILD ${PIKO_UNITE} UNITY_BUILD_BATCH_SIZE ${PIKO_UNITE_FILES})
endfunction()

# piko_unite_apart(<target> <source>...)
# Compiles these sources as one, and none of the others with them.
function(piko_unite_apart target)
  get_target_property(sources ${target} SOURCES)
  list(REMOVE_ITEM sources ${ARGN})
  set_source_files_properties(${ARGN} PROPERTIES UNITY_GROUP apart)
  set(count 0)
  foreach(source ${sources})
    math(EXPR batch "${count} / ${PIKO_UNITE_FILES}")
    set_source_files_properties(${source} PROPERTIES UNITY_GROUP ${batch})
    math(EXPR count "${count} + 1")
  endforeach()
  set_target_properties(${target} PROPERTIES UNITY_BUILD_MODE GROUP)
endfunction()

# For each program.
function(piko_add_sanitizer_options name)
  if(PIKO_SANITIZE)
    target_link_libraries(${name} PRIVATE $<TARGET_OBJECTS:piko_sanitizer_options>)
  endif()
endfunction()

# piko_add_library(PikoX SOURCES... [DEPENDS tablegen targets] [LINK libraries]
#                  [PRECOMPILED mlir|clang|none])
# A static library of the compiler.
function(piko_add_library name)
  cmake_parse_arguments(ARG "" "PRECOMPILED" "DEPENDS;LINK" ${ARGN})
  add_library(${name} STATIC ${ARG_UNPARSED_ARGUMENTS})
  target_link_libraries(${name} PRIVATE piko_options PUBLIC piko_llvm ${ARG_LINK})
  target_compile_options(${name} PRIVATE ${PIKO_COMPILER_FLAGS})
  if(ARG_DEPENDS)
    add_dependencies(${name} ${ARG_DEPENDS})
  endif()
  if(NOT ARG_PRECOMPILED)
    set(ARG_PRECOMPILED mlir)
  endif()
  if(NOT ARG_PRECOMPILED STREQUAL "none")
    piko_use_precompiled(${name} piko_precompiled_${ARG_PRECOMPILED})
  endif()
  piko_unite(${name})
endfunction()

# Compilers spend much of their time in malloc. Sanitizers have their own.
find_library(PIKO_MALLOC mimalloc DOC "Allocator of the tools, if any")
find_path(PIKO_MALLOC_INCLUDE_DIR mimalloc.h)
if(PIKO_MALLOC AND PIKO_MALLOC_INCLUDE_DIR AND NOT PIKO_SANITIZE)
  add_library(piko_allocator_options OBJECT
    ${CMAKE_CURRENT_LIST_DIR}/AllocatorOptions.cpp)
  target_include_directories(piko_allocator_options SYSTEM PRIVATE
    ${PIKO_MALLOC_INCLUDE_DIR})
  target_link_libraries(piko_allocator_options PRIVATE piko_options)
  set(PIKO_MALLOC_FLAGS $<TARGET_OBJECTS:piko_allocator_options>
    -Wl,--push-state,--no-as-needed ${PIKO_MALLOC} -Wl,--pop-state)
endif()

# piko_add_tool(name SOURCES... [LINK libraries])
function(piko_add_tool name)
  cmake_parse_arguments(ARG "" "" "LINK" ${ARGN})
  add_executable(${name} ${ARG_UNPARSED_ARGUMENTS})
  target_link_libraries(${name} PRIVATE
    ${PIKO_MALLOC_FLAGS} piko_options ${ARG_LINK})
  piko_unite(${name})
  piko_add_sanitizer_options(${name})
endfunction()

# Seconds of a test. With sanitizers everything takes several times as long.
if(PIKO_SANITIZE)
  set(PIKO_TEST_TIMEOUT 3600)
else()
  set(PIKO_TEST_TIMEOUT 900)
endif()

# piko_add_unittest(name SOURCES... [LINK libraries] [APART]): a GoogleTest program
# that is one test of CTest's: what starts takes longer than most cases. Its files are
# compiled one by one if APART, because they have names in common.
function(piko_add_unittest name)
  cmake_parse_arguments(ARG "APART" "" "LINK" ${ARGN})
  add_executable(${name} ${ARG_UNPARSED_ARGUMENTS})
  target_link_libraries(${name} PRIVATE piko_options ${ARG_LINK} GTest::gtest GTest::gtest_main)
  # It runs for less long than -O3 takes.
  target_compile_options(${name} PRIVATE $<$<CONFIG:Release>:-O1>)
  if(NOT ARG_APART)
    piko_unite(${name})
  endif()
  piko_add_sanitizer_options(${name})
  # Tests have more threads than cores: to wait must not cost time.
  add_test(NAME ${name} COMMAND ${name})
  set_tests_properties(${name} PROPERTIES COST 10
    TIMEOUT ${PIKO_TEST_TIMEOUT} ENVIRONMENT OMP_WAIT_POLICY=passive)
endfunction()
if(BUILD_TESTING OR NOT DEFINED BUILD_TESTING)
  if(CMAKE_CROSSCOMPILING)
    # Debian has the library for the machine that builds, and its source for others.
    set(PIKO_GTEST_SOURCE /usr/src/googletest/googletest CACHE PATH "GoogleTest's source")
    set(INSTALL_GTEST OFF)
    add_subdirectory(${PIKO_GTEST_SOURCE} ${PROJECT_BINARY_DIR}/googletest EXCLUDE_FROM_ALL)
  else()
    find_package(GTest REQUIRED)
  endif()
endif()
