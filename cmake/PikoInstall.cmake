# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#
# What `cmake --install` copies, and the package that find_package(Piko) finds
# in the build tree and in the installed one.
include(CMakePackageConfigHelpers)
include(GNUInstallDirs)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/Piko)
set(build_package_dir ${PROJECT_BINARY_DIR}/lib/cmake/Piko)

set_target_properties(pikort PROPERTIES EXPORT_NAME runtime)
install(TARGETS pikort EXPORT PikoTargets)
install(DIRECTORY runtime/include/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(DIRECTORY docs/ DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(FILES LICENSE README.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
if(PIKO_ENABLE_COMPILER)
  set(tools piko-diff piko-render piko-translate piko-tune)
  if(PIKO_ENABLE_GPU)
    list(APPEND tools piko-opt)
  endif()
  if(PIKO_ENABLE_ASSIMP)
    list(APPEND tools piko-import)
  endif()
  set_target_properties(pikoc ${tools} PROPERTIES
    INSTALL_RPATH "$ORIGIN/../${CMAKE_INSTALL_LIBDIR};${PIKO_LLVM_PREFIX}/lib")
  install(TARGETS pikoc EXPORT PikoTargets)
  install(TARGETS ${tools})
  install(TARGETS PikoBvh LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
  if(PIKO_ENABLE_OPENIMAGEIO)
    install(TARGETS PikoImage LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
  endif()
endif()

install(EXPORT PikoTargets NAMESPACE Piko:: DESTINATION ${package_dir})
export(EXPORT PikoTargets NAMESPACE Piko::
  FILE ${build_package_dir}/PikoTargets.cmake)

configure_package_config_file(cmake/PikoConfig.cmake.in
  ${build_package_dir}/PikoConfig.cmake
  INSTALL_DESTINATION ${package_dir} NO_SET_AND_CHECK_MACRO
  NO_CHECK_REQUIRED_COMPONENTS_MACRO)
write_basic_package_version_file(${build_package_dir}/PikoConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
configure_file(cmake/PikoAddPipeline.cmake ${build_package_dir} COPYONLY)
install(FILES
  ${build_package_dir}/PikoConfig.cmake
  ${build_package_dir}/PikoConfigVersion.cmake
  cmake/PikoAddPipeline.cmake
  DESTINATION ${package_dir})
