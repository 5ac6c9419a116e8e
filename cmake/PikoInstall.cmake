# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#
# What `cmake --install` copies, by component, and the package that find_package(Piko)
# finds in the build tree and in the installed one, wherever that is moved to.
#
#   runtime        libpikort
#   mpi            libpikort-mpi, where there is an MPI
#   mpidevelopment what links it
#   development    pikort's headers and the dialect's, the CMake package, static
#                  libraries of the compiler
#   tools          pikoc, piko-render, ..., and piko.h, which they read
#   compiler       libpiko, the compiler as a library
#   documentation  documents and the examples
#   python         a module for Python, where a target PikoPython is one
include(CMakePackageConfigHelpers)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/Piko)
set(build_package_dir ${PROJECT_BINARY_DIR}/lib/cmake/Piko)
# What only the tools load.
set(module_dir ${CMAKE_INSTALL_LIBDIR}/piko/modules)

# Who makes packages of the components, PikoPackages.cmake, finds here which there are.
set(PIKO_COMPONENTS runtime development documentation)
set_target_properties(pikort PROPERTIES EXPORT_NAME runtime)
install(TARGETS pikort EXPORT PikoTargets
  LIBRARY COMPONENT runtime NAMELINK_COMPONENT development)
if(TARGET pikort-mpi)
  list(APPEND PIKO_COMPONENTS mpi mpidevelopment)
  set_target_properties(pikort-mpi PROPERTIES EXPORT_NAME mpi)
  install(TARGETS pikort-mpi EXPORT PikoMPITargets
    LIBRARY COMPONENT mpi NAMELINK_COMPONENT mpidevelopment)
  install(EXPORT PikoMPITargets NAMESPACE Piko:: DESTINATION ${package_dir}
    COMPONENT mpidevelopment)
  export(EXPORT PikoMPITargets NAMESPACE Piko::
    FILE ${build_package_dir}/PikoMPITargets.cmake)
endif()
install(DIRECTORY runtime/include/pikort DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}
  COMPONENT development)
# The tools read what pipelines include.
install(FILES runtime/include/piko.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT tools)
install(DIRECTORY runtime/include/piko DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}
  COMPONENT tools)
install(DIRECTORY docs DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT documentation
  PATTERN site EXCLUDE)
install(DIRECTORY examples DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT documentation
  REGEX "examples/[a-z]+/CMakeLists.txt$" EXCLUDE
  REGEX "examples/CMakeLists.txt$" EXCLUDE)
install(FILES README.md CHANGELOG.md CONTRIBUTING.md SECURITY.md CITATION.cff
  DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT documentation)
install(DIRECTORY benchmarks/results DESTINATION ${CMAKE_INSTALL_DOCDIR}/benchmarks
  COMPONENT documentation FILES_MATCHING PATTERN "*.md" PATTERN speed-error EXCLUDE)
install(FILES benchmarks/README.md DESTINATION ${CMAKE_INSTALL_DOCDIR}/benchmarks
  COMPONENT documentation)
# A Debian package has it in its own form.
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT licence)
# Links of documents to what only the tree has become text.
find_package(Python3 COMPONENTS Interpreter)
if(Python3_Interpreter_FOUND)
  file(RELATIVE_PATH headers /prefix/${CMAKE_INSTALL_DOCDIR} /prefix/${CMAKE_INSTALL_INCLUDEDIR})
  install(CODE "execute_process(COMMAND \"${Python3_EXECUTABLE}\"
    \"${PROJECT_SOURCE_DIR}/utils/install-documents.py\"
    --source \"${PROJECT_SOURCE_DIR}\" --include \"${headers}\"
    \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_DOCDIR}\"
    COMMAND_ERROR_IS_FATAL ANY)" COMPONENT documentation)
endif()

if(PIKO_ENABLE_COMPILER)
  list(APPEND PIKO_COMPONENTS tools compiler)
  set(PIKO_TOOLS pikoc piko-diff piko-render piko-render-library piko-translate piko-tune)
  if(PIKO_ENABLE_GPU)
    list(APPEND PIKO_TOOLS piko-opt)
  endif()
  if(PIKO_ENABLE_ASSIMP)
    list(APPEND PIKO_TOOLS piko-import)
  endif()
  if(TARGET PikoPython)
    list(APPEND PIKO_COMPONENTS python)
  endif()
  set_target_properties(${PIKO_TOOLS} PROPERTIES INSTALL_RPATH
    "$ORIGIN/../${CMAKE_INSTALL_LIBDIR};$ORIGIN/../${module_dir};${PIKO_LLVM_PREFIX}/lib")
  install(TARGETS ${PIKO_TOOLS} EXPORT PikoTargets RUNTIME COMPONENT tools)
  set(modules PikoBvh)
  if(PIKO_ENABLE_OPENIMAGEIO)
    list(APPEND modules PikoImage)
  endif()
  # From the tables of options that the tools have.
  if(Python3_Interpreter_FOUND)
    set(manuals ${PROJECT_BINARY_DIR}/manuals)
    set(make_manuals ${PROJECT_SOURCE_DIR}/utils/make-manuals.py)
    set(files "")
    foreach(tool ${PIKO_TOOLS})
      list(APPEND files $<TARGET_FILE:${tool}>)
    endforeach()
    add_custom_command(OUTPUT ${manuals}/done
      COMMAND Python3::Interpreter ${make_manuals} --out ${manuals} ${files}
      COMMAND ${CMAKE_COMMAND} -E touch ${manuals}/done
      DEPENDS ${PIKO_TOOLS} ${make_manuals}
      COMMENT "Writing manual pages and completions" VERBATIM)
    add_custom_target(manuals ALL DEPENDS ${manuals}/done)
    install(DIRECTORY ${manuals}/man1 DESTINATION ${CMAKE_INSTALL_MANDIR} COMPONENT tools)
    install(DIRECTORY ${manuals}/bash/
      DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions COMPONENT tools)
    install(DIRECTORY ${manuals}/zsh/
      DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/site-functions COMPONENT zsh)
    # Where Debian's packages have it.
    install(DIRECTORY ${manuals}/zsh/
      DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions
      COMPONENT tools EXCLUDE_FROM_ALL)
  endif()
  install(TARGETS ${modules} LIBRARY DESTINATION ${module_dir} COMPONENT tools)

  # What somebody else's passes and tools are made with.
  set(libraries PikoAnalysis PikoCompilerBuild PikoConversion PikoDialect PikoDriver
    PikoFrontend PikoLibraryLoader PikoRegistration PikoReplay PikoSupport PikoTargetCPU
    PikoTargetGraphviz PikoTargetSupport PikoTransforms)
  if(PIKO_ENABLE_GPU)
    list(APPEND libraries PikoConversionGPU PikoTargetNVPTX)
  endif()
  foreach(library ${libraries})
    string(REGEX REPLACE "^Piko" "" name ${library})
    set_target_properties(${library} PROPERTIES EXPORT_NAME ${name})
  endforeach()
  foreach(part options llvm clang)
    set_target_properties(piko_${part} PROPERTIES EXPORT_NAME ${part})
  endforeach()
  install(TARGETS ${libraries} piko_options piko_llvm piko_clang
    EXPORT PikoDialectTargets ARCHIVE COMPONENT development)
  foreach(headers ${PROJECT_SOURCE_DIR}/include/Piko ${PROJECT_BINARY_DIR}/include/Piko)
    install(DIRECTORY ${headers} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}
      COMPONENT development
      FILES_MATCHING PATTERN "*.h" PATTERN "*.td" PATTERN "*.h.inc"
      PATTERN CMakeFiles EXCLUDE)
  endforeach()
  install(EXPORT PikoDialectTargets NAMESPACE Piko:: DESTINATION ${package_dir}
    COMPONENT development)
  export(EXPORT PikoDialectTargets NAMESPACE Piko::
    FILE ${build_package_dir}/PikoDialectTargets.cmake)
endif()

install(EXPORT PikoTargets NAMESPACE Piko:: DESTINATION ${package_dir}
  COMPONENT development)
export(EXPORT PikoTargets NAMESPACE Piko::
  FILE ${build_package_dir}/PikoTargets.cmake)

configure_package_config_file(cmake/PikoConfig.cmake.in
  ${build_package_dir}/PikoConfig.cmake
  INSTALL_DESTINATION ${package_dir} NO_SET_AND_CHECK_MACRO)
write_basic_package_version_file(${build_package_dir}/PikoConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
configure_file(cmake/PikoAddPipeline.cmake ${build_package_dir} COPYONLY)
install(FILES
  ${build_package_dir}/PikoConfig.cmake
  ${build_package_dir}/PikoConfigVersion.cmake
  cmake/PikoAddPipeline.cmake
  DESTINATION ${package_dir} COMPONENT development)
