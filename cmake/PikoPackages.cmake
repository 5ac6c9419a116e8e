# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#
# Debian packages of the components that PikoInstall.cmake names, by `cpack` or
# `make packages`. What they depend on is read from their files by dpkg-shlibdeps; what
# no file says, as the headers that pikoc reads, is named here.
if(NOT PIKO_ENABLE_COMPILER)
  return() # packages are of all
endif()
set(PIKO_PACKAGE_CONTACT "Piko's maintainers <maintainers@piko.invalid>"
  CACHE STRING "Who answers for the packages")
set(release 1)
set(version "${PROJECT_VERSION}-${release}")
set(llvm ${PIKO_LLVM_VERSION})
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME piko)
set(CPACK_PACKAGE_CONTACT ${PIKO_PACKAGE_CONTACT})
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
# CPack puts another one before each package's own.
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_NAME} built using CMake")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR}/packages)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL ${PIKO_COMPONENTS})
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE ${release})
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)
# libpikort is found where it was built; its package is named below.
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS
  ${PROJECT_BINARY_DIR}/lib ${PIKO_LLVM_PREFIX}/lib)

# piko_add_package(<component> <name> SUMMARY text [TEXT lines] [SECTION name]
#                  [DEPENDS packages] [RECOMMENDS packages] [ALL]
#                  [SHARED "library version"])
# ALL: it has no machine's code. SHARED: what programs link that depend on it.
function(piko_add_package component name)
  cmake_parse_arguments(ARG "ALL" "SHARED;SUMMARY;TEXT;SECTION" "DEPENDS;RECOMMENDS" ${ARGN})
  if(NOT component IN_LIST PIKO_COMPONENTS)
    return()
  endif()
  string(TOUPPER ${component} upper)
  list(JOIN ARG_DEPENDS ", " depends)
  list(JOIN ARG_RECOMMENDS ", " recommends)
  set(prefix CPACK_DEBIAN_${upper}_PACKAGE)
  set(${prefix}_NAME ${name} PARENT_SCOPE)
  set(${prefix}_DEPENDS "${depends}" PARENT_SCOPE)
  set(${prefix}_RECOMMENDS "${recommends}" PARENT_SCOPE)
  if(ARG_ALL)
    set(${prefix}_ARCHITECTURE all PARENT_SCOPE)
    set(${prefix}_SHLIBDEPS OFF PARENT_SCOPE)
  else()
    set(${prefix}_SHLIBDEPS ON PARENT_SCOPE)
  endif()
  if(ARG_SHARED)
    set(control ${PROJECT_BINARY_DIR}/packages-data/${component})
    file(MAKE_DIRECTORY ${control})
    file(WRITE ${control}/triggers "activate-noawait ldconfig\n")
    file(WRITE ${control}/shlibs "${ARG_SHARED} ${name} (>= ${PROJECT_VERSION})\n")
    set(${prefix}_CONTROL_EXTRA ${control}/triggers ${control}/shlibs PARENT_SCOPE)
  endif()
  if(ARG_SECTION)
    set(${prefix}_SECTION ${ARG_SECTION} PARENT_SCOPE)
  endif()
  set(CPACK_DEBIAN_${upper}_DESCRIPTION "${ARG_SUMMARY}\n${ARG_TEXT}" PARENT_SCOPE)
  # What Debian's policy wants in each package.
  set(data ${PROJECT_SOURCE_DIR}/cmake/packages)
  install(FILES ${data}/copyright DESTINATION share/doc/${name}
    COMPONENT ${component} EXCLUDE_FROM_ALL)
  install(FILES ${PROJECT_BINARY_DIR}/packages-data/changelog.Debian.gz
    DESTINATION share/doc/${name} COMPONENT ${component} EXCLUDE_FROM_ALL)
  if(EXISTS ${data}/${component}.lintian-overrides)
    install(FILES ${data}/${component}.lintian-overrides RENAME ${name}
      DESTINATION share/lintian/overrides COMPONENT ${component} EXCLUDE_FROM_ALL)
  endif()
endfunction()

file(STRINGS cmake/packages/changelog changes LIMIT_COUNT 1)
if(NOT changes MATCHES "^piko \\(${PROJECT_VERSION}-${release}\\) ")
  message(FATAL_ERROR
    "expected cmake/packages/changelog to begin with version ${version}, but got: ${changes}")
endif()
file(MAKE_DIRECTORY ${PROJECT_BINARY_DIR}/packages-data)
find_program(PIKO_GZIP gzip)
mark_as_advanced(PIKO_GZIP)
if(NOT PIKO_GZIP)
  return()
endif()
execute_process(COMMAND ${PIKO_GZIP} -9nc ${PROJECT_SOURCE_DIR}/cmake/packages/changelog
  OUTPUT_FILE ${PROJECT_BINARY_DIR}/packages-data/changelog.Debian.gz)

set(needed "libpikort${PIKO_ABI_VERSION} (= ${version})")
# Lines of at most 80 characters, as Debian wants them.
set(about "Piko compiles graphics pipelines that are written in C++ as graphs of
stages, each with its bins of the screen.
.
This package has")
piko_add_package(runtime libpikort${PIKO_ABI_VERSION}
  SECTION libs SHARED "libpikort ${PIKO_ABI_VERSION}"
  SUMMARY "runtime of compiled Piko pipelines"
  TEXT "${about} the shared library of compiled pipelines and their
hosts.")
piko_add_package(mpi libpikort-mpi${PIKO_ABI_VERSION}
  SECTION libs SHARED "libpikort-mpi ${PIKO_ABI_VERSION}"
  SUMMARY "Piko pipelines in several processes, by MPI"
  TEXT "${about} what lets the processes of an MPI program run one
pipeline together."
  DEPENDS "${needed}")
piko_add_package(mpidevelopment libpikort-mpi-dev SECTION libdevel
  SUMMARY "links applications to Piko's ranks by MPI"
  TEXT "${about} what applications are built with whose processes run
one pipeline together; the headers are in libpiko-dev."
  DEPENDS "libpikort-mpi${PIKO_ABI_VERSION} (= ${version})" "libpiko-dev (= ${version})"
    "libopenmpi-dev | libmpich-dev")
piko_add_package(tools piko-tools SECTION devel
  SUMMARY "compiler and tools for programmable graphics pipelines"
  TEXT "${about} pikoc, which compiles pipelines, piko.h, which they
include, and tools that render, tune and compare them."
  DEPENDS "${needed}" libclang-common-${llvm}-dev "libstdc++-12-dev | libstdc++-dev"
    libglm-dev
  RECOMMENDS "libpiko-dev (= ${version})")
piko_add_package(compiler libpiko${PIKO_SOVERSION}
  SECTION libs SHARED "libpiko ${PIKO_SOVERSION}"
  SUMMARY "compiler of graphics pipelines as a library"
  TEXT "${about} the compiler as a shared library with a C interface, for
applications that compile pipelines while they run."
  DEPENDS "${needed}" "piko-tools (= ${version})")
piko_add_package(development libpiko-dev SECTION libdevel
  SUMMARY "headers, CMake package and libraries of Piko"
  TEXT "${about} what applications with compiled pipelines are built
with, and what passes and tools for Piko's MLIR dialect are: headers, static
libraries, and a package for CMake. The dialect also needs the packages that
this one recommends."
  DEPENDS "${needed}" "libpiko${PIKO_SOVERSION} (= ${version})" "piko-tools (= ${version})"
    libomp-${llvm}-dev
  RECOMMENDS libmlir-${llvm}-dev llvm-${llvm}-dev mlir-${llvm}-tools)
piko_add_package(python python3-piko SECTION python
  SUMMARY "pipelines compiled and run from Python"
  TEXT "${about} the module piko for Python."
  DEPENDS "${needed}" "libpiko${PIKO_SOVERSION} (= ${version})" python3 python3-numpy)
piko_add_package(documentation piko-doc ALL SECTION doc
  SUMMARY "documentation and examples of Piko"
  TEXT "${about} the documents and the example pipelines.")
include(CPack)
